#include "qjulia/colors.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cstdint>
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

const std::vector<std::pair<std::string, Palette>>& palettes() {
  static const std::vector<std::pair<std::string, Palette>> all{
      {"earth", {}},
      {"ember", {of(0xC8553D), {of(0x1B0C2A), of(0x7A1F3D), of(0xE4572E), of(0xFFD166)}}},
      {"ice", {of(0xA9C6D9), {of(0x0B2545), of(0x2A6F97), of(0x89C2D9), of(0xF1F7FA)}}},
      {"moss", {of(0x8A9A5B), {of(0x14281D), of(0x355834), of(0x8A9A5B), of(0xE9E4C9)}}},
      {"grey", {of(0xB8B8B8), {of(0x262626), of(0x7A7A7A), of(0xC4C4C4), of(0xF5F5F5)}}}};
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
