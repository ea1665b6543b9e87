#include "qjulia/base/colors.hpp"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <numbers>
#include <utility>

#include "base/srgb.hpp"

namespace qjulia {
namespace {

constexpr double kMost = 255;

Rgb of(std::uint32_t hex) {
  const auto part = [&](unsigned shift) {
    return base::srgb_decoded(static_cast<double>((hex >> shift) & 0xFFU) / kMost);
  };
  return {part(16), part(8), part(0)};
}

/// A colour by its perceived lightness 0 … 1, how colourful it is, and its hue in degrees: OKLab
/// (Ottosson 2020, "A perceptual color space for image processing") in polar coordinates.
Rgb of_lightness(double lightness, double chroma, double hue) {
  const double angle = hue * std::numbers::pi / 180;
  const Eigen::Vector3d lab(lightness, chroma * std::cos(angle), chroma * std::sin(angle));
  Eigen::Matrix3d to_roots, to_rgb;
  to_roots << 1, 0.3963377774, 0.2158037573,  //
      1, -0.1055613458, -0.0638541728,        //
      1, -0.0894841775, -1.2914855480;
  to_rgb << 4.0767416621, -3.3077115913, 0.2309699292,  //
      -1.2684380046, 2.6097574011, -0.3413193965,       //
      -0.0041960863, -0.7034186147, 1.7076147010;
  const Eigen::Vector3d cones = (to_roots * lab).array().cube();
  return (to_rgb * cones).cwiseMax(0).cwiseMin(1);
}

/// Lightness rises by the same step from stop to stop.
Palette even(std::initializer_list<std::array<double, 3>> stops) {
  Palette palette;
  palette.stops.clear();
  for (const auto& [lightness, chroma, hue] : stops) {
    palette.stops.push_back(of_lightness(lightness, chroma, hue));
  }
  palette.clay = palette.stops[palette.stops.size() * 5 / 8];
  return palette;
}

/// Once around the hues, light half-way: its end is its beginning.
Palette cyclic() {
  constexpr double kDarkest = 0.4, kRise = 0.42, kFirstHue = 300;
  constexpr int kLast = Palette::kMostStops - 1;
  Palette palette;
  palette.stops.clear();
  for (int i = 0; i <= kLast; ++i) {
    const double lightness = kDarkest + kRise * (1 - std::abs(2.0 * i / kLast - 1));
    palette.stops.push_back(
        of_lightness(lightness, lightness > 0.5 ? 0.085 : 0.1, kFirstHue - 360.0 * i / kLast));
  }
  palette.clay = palette.stops[2];
  return palette;
}

const std::vector<std::pair<std::string, Palette>>& palettes() {
  static const std::vector<std::pair<std::string, Palette>> all{
      {"earth", {}},
      {"ember", {of(0xC8553D), {of(0x1B0C2A), of(0x7A1F3D), of(0xE4572E), of(0xFFD166)}}},
      {"ice", {of(0xA9C6D9), {of(0x0B2545), of(0x2A6F97), of(0x89C2D9), of(0xF1F7FA)}}},
      {"moss", {of(0x8A9A5B), {of(0x14281D), of(0x355834), of(0x8A9A5B), of(0xE9E4C9)}}},
      {"grey", {of(0xB8B8B8), {of(0x262626), of(0x7A7A7A), of(0xC4C4C4), of(0xF5F5F5)}}},
      {"fern", even({{0.28, 0.13, 310},
                     {0.37, 0.13, 285},
                     {0.46, 0.11, 252},
                     {0.55, 0.095, 212},
                     {0.64, 0.11, 180},
                     {0.73, 0.14, 152},
                     {0.82, 0.17, 128},
                     {0.91, 0.175, 108}})},
      {"slate", even({{0.26, 0.085, 258},
                      {0.355, 0.075, 262},
                      {0.45, 0.035, 268},
                      {0.545, 0.012, 280},
                      {0.64, 0.025, 100},
                      {0.735, 0.07, 98},
                      {0.83, 0.115, 97},
                      {0.92, 0.145, 98}})},
      {"dusk", even({{0.17, 0.05, 290},
                     {0.28, 0.11, 297},
                     {0.39, 0.15, 318},
                     {0.5, 0.18, 346},
                     {0.61, 0.18, 14},
                     {0.72, 0.145, 40},
                     {0.83, 0.105, 70},
                     {0.94, 0.07, 95}})},
      {"wheel", cyclic()}};
  return all;
}

}  // namespace

std::optional<Rgb> color_named(std::string_view text) {
  if (text == "white") return of(0xFFFFFF);
  if (text == "black") return of(0);
  if (text.starts_with('#')) text.remove_prefix(1);
  if (text.size() != 3 && text.size() != 6) return std::nullopt;
  std::uint32_t hex = 0;
  const auto [end, error] = std::from_chars(text.begin(), text.end(), hex, 16);
  if (error != std::errc() || end != text.end()) return std::nullopt;
  // Each of three digits stands for two.
  if (text.size() == 3) hex = 0x11 * ((hex & 0xF00U) << 8 | (hex & 0xF0U) << 4 | (hex & 0xFU));
  return of(hex);
}

std::string color_name(const Rgb& color) {
  const auto part = [&](Eigen::Index i) { return base::byte_of(base::srgb_encoded(color[i])); };
  return fmt::format("#{:02x}{:02x}{:02x}", part(0), part(1), part(2));
}

std::optional<Palette> palette_named(std::string_view name) {
  for (const auto& [its_name, palette] : palettes()) {
    if (name == its_name) return palette;
  }
  return std::nullopt;
}

std::vector<std::string> palette_names() {
  std::vector<std::string> names;
  for (const auto& [name, palette] : palettes()) names.push_back(name);
  return names;
}

}  // namespace qjulia
