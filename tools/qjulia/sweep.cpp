#include "sweep.hpp"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <numbers>

#include "base/text.hpp"
#include "qjulia/error.hpp"

namespace qjulia::tools {
namespace {

constexpr int kMostFrames = 10000;

using Setter = void (*)(double, MapOptions&, PictureOptions&);

/// cos A + u sin A, for a unit vector along `axis` (1: i, 2: j, 3: k) and A in degrees.
Quaternion turned_phase(int axis, double degrees) {
  const double angle = degrees * std::numbers::pi / 180;
  Quaternion phase{std::cos(angle), 0, 0, 0};
  (axis == 1 ? phase.y : axis == 2 ? phase.z : phase.w) = std::sin(angle);
  return phase;
}

int whole(const char* name, double value) {
  if (value != std::round(value) || std::abs(value) > 1e9) {
    throw InputError(fmt::format("--sweep {}: {} is not a whole number", name, value));
  }
  return static_cast<int>(value);
}

const std::map<std::string, Setter>& setters() {
  static const std::map<std::string, Setter> all = {
      {"azimuth", [](double v, MapOptions&, PictureOptions& p) { p.camera.azimuth = v; }},
      {"elevation", [](double v, MapOptions&, PictureOptions& p) { p.camera.elevation = v; }},
      {"zoom", [](double v, MapOptions&, PictureOptions& p) { p.camera.zoom = v; }},
      {"iterations",
       [](double v, MapOptions& m, PictureOptions& p) {
         m.iterations = p.iterations = whole("iterations", v);
       }},
      {"detail",
       [](double v, MapOptions& m, PictureOptions&) {
         if (v <= 0) throw InputError(fmt::format("--sweep detail: {} is not positive", v));
         m.detail = v;
       }},
      {"drift", [](double v, MapOptions& m, PictureOptions&) { m.knobs.drift = v; }},
      {"slice", [](double v, MapOptions& m, PictureOptions&) { m.knobs.slice = v; }},
      {"scale", [](double v, MapOptions& m, PictureOptions&) { m.knobs.scale = v; }},
      {"tufts", [](double v, MapOptions& m, PictureOptions&) { m.knobs.tufts = v; }},
      {"order-seed",
       [](double v, MapOptions& m, PictureOptions&) {
         const int seed = whole("order-seed", v);
         if (seed < 0) throw InputError(fmt::format("--sweep order-seed: {} is below 0", seed));
         m.knobs.order_seed = static_cast<std::uint64_t>(seed);
       }},
      {"phase-i",
       [](double v, MapOptions& m, PictureOptions&) { m.knobs.phase = turned_phase(1, v); }},
      {"phase-j",
       [](double v, MapOptions& m, PictureOptions&) { m.knobs.phase = turned_phase(2, v); }},
      {"phase-k",
       [](double v, MapOptions& m, PictureOptions&) { m.knobs.phase = turned_phase(3, v); }}};
  return all;
}

InputError unreadable(const std::string& text) {
  return InputError(fmt::format(
      "--sweep '{}' is neither NAME=FROM:TO:COUNT, such as drift=0:1.05:12, nor NAME=A,B,C", text));
}

std::vector<double> numbers(const std::string& list, char between, const std::string& whole_text) {
  std::vector<double> values;
  for (const std::string& word : base::split(list, between)) {
    const auto value = base::number_in<double>(word);
    if (!value || !std::isfinite(*value)) throw unreadable(whole_text);
    values.push_back(*value);
  }
  return values;
}

}  // namespace

const char* const kSweepNames =
    "detail, drift, slice, scale, tufts, order-seed, phase-i, phase-j, phase-k (the phase cos A + "
    "i sin "
    "A, A in degrees), iterations, azimuth, elevation, zoom";

Sweep parse_sweep(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos) throw unreadable(text);
  Sweep sweep{text.substr(0, equals), {}};
  if (!setters().contains(sweep.name)) {
    throw InputError(
        fmt::format("--sweep: there is no '{}' to sweep; it can be {}", sweep.name, kSweepNames));
  }
  const std::string list = text.substr(equals + 1);
  if (list.find(':') == std::string::npos) {
    sweep.values = numbers(list, ',', text);
    return sweep;
  }
  const auto range = numbers(list, ':', text);
  if (range.size() != 3 || range[2] != std::round(range[2])) throw unreadable(text);
  if (range[2] < 2 || range[2] > kMostFrames) {
    throw InputError(fmt::format("--sweep {}: COUNT is 2 to {}", text, kMostFrames));
  }
  const int count = static_cast<int>(range[2]);
  for (int i = 0; i < count; ++i) {
    sweep.values.push_back(std::lerp(range[0], range[1], double(i) / (count - 1)));
  }
  return sweep;
}

Sweep turntable(double first, int count) {
  Sweep sweep{"azimuth", {}};
  for (int i = 0; i < count; ++i) sweep.values.push_back(first + 360.0 * i / count);
  return sweep;
}

bool is_of_camera(const Sweep& sweep) {
  return sweep.name == "azimuth" || sweep.name == "elevation" || sweep.name == "zoom";
}

void set(const Sweep& sweep, double value, MapOptions& map, PictureOptions& picture) {
  setters().at(sweep.name)(value, map, picture);
}

}  // namespace qjulia::tools
