#include "jobs/picture_sweep.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "base/text.hpp"
#include "describe/files.hpp"
#include "describe/moving_settings.hpp"
#include "describe/provenance.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/picture/picture_settings.hpp"

namespace qjulia::tools {
namespace {

constexpr int kMostFrames = 10000;

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

/// A setting that one number sweeps. Null where there is none.
const MovingSetting* swept_setting(const std::string& name) {
  const auto found = moving_settings().find(name);
  const bool is_swept = found != moving_settings().end() && found->second.numbers == 1;
  return is_swept ? &found->second : nullptr;
}

/// The options that go by equal ratios, for help.
std::string names_of_ratios() {
  std::vector<std::string> names;
  for (const auto& [name, setting] : moving_settings()) {
    if (setting.interpolation == Interpolation::logarithmic) names.push_back(name);
  }
  return fmt::format("{}", fmt::join(names, ", "));
}

/// "NAME=FROM:TO:COUNT", both ends included and by equal steps or ratios, or "NAME=A,B,C". @throws
/// InputError
Sweep parse_sweep(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos) throw unreadable(text);
  Sweep sweep{text.substr(0, equals), {}};
  if (swept_setting(sweep.name) == nullptr) {
    throw InputError(
        fmt::format("--sweep: there is no '{}' to sweep; it can be {}", sweep.name, sweep_names()));
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
  const bool has_equal_ratios =
      swept_setting(sweep.name)->interpolation == Interpolation::logarithmic && range[0] > 0 &&
      range[1] > 0;
  for (int i = 0; i < count; ++i) {
    const double way = double(i) / (count - 1);
    sweep.values.push_back(has_equal_ratios && i > 0 && i + 1 < count
                               ? range[0] * std::pow(range[1] / range[0], way)
                               : std::lerp(range[0], range[1], way));
  }
  return sweep;
}

/// Whether only the camera moves.
bool is_of_camera(const Sweep& sweep) {
  const auto found = std::ranges::find_if(
      picture_settings(), [&](const auto& setting) { return setting.option() == sweep.name; });
  return found != picture_settings().end() && found->is_of_camera;
}

/// `count` azimuths once around, from `first` on.
Sweep turntable(double first, int count) {
  Sweep sweep{"azimuth", {}};
  for (int i = 0; i < count; ++i) sweep.values.push_back(first + 360.0 * i / count);
  return sweep;
}

/// @throws InputError where the option that is swept has a value of its own too.
void expect_not_given(const std::vector<Option>& camera, const MapOptions& map_options,
                      const std::string& swept) {
  for (const auto& options : {camera, map_options.options}) {
    for (const Option& option : options) {
      if (option.name() != swept || !option.given()) continue;
      throw InputError(fmt::format("--sweep sets {} for each picture; leave out {}", swept, swept));
    }
  }
}

}  // namespace

std::vector<View> Sweep::views(const View& base) const {
  std::vector<View> all;
  all.reserve(values.size());
  for (const double value : values) {
    swept_setting(name)->set(std::span(&value, 1), all.emplace_back(base));
  }
  return all;
}

std::string sweep_names() {
  std::vector<std::string> names;
  for (const auto& [name, setting] : moving_settings()) {
    if (setting.numbers == 1) names.push_back(name);
  }
  return fmt::format(
      "{}; phase-i is the phase cos A + i sin A, A in degrees. From FROM to TO, {} go by equal "
      "ratios, the others by equal steps",
      fmt::join(names, ", "), names_of_ratios());
}

std::optional<Sweep> wanted_sweep(const SweepChoice& wanted, const std::string& input,
                                  const View& base, const std::vector<Option>& camera) {
  if (wanted.sweep && wanted.turntable) {
    throw InputError("give either --sweep or --turntable");
  }
  if (wanted.turntable) return turntable(base.picture.camera.azimuth, *wanted.turntable);
  if (!wanted.sweep) return std::nullopt;
  Sweep sweep = parse_sweep(*wanted.sweep);
  expect_not_given(camera, base.map_options, "--" + swept_setting(sweep.name)->of);
  // Refused before the first picture is drawn, not after some.
  try {
    for (const View& view : sweep.views(base)) {
      view.map_options.knobs.validate();
      view.picture.validate();
    }
  } catch (const InputError& error) {
    throw InputError(fmt::format("--sweep {}: {}", sweep.name, error.what()));
  }
  if (!is_of_camera(sweep)) expect_map("--sweep " + sweep.name, input);
  return sweep;
}

Job frame_job(Job job, const View& asked, const View& drawn) {
  job.options.erase("sweep");
  job.options.erase("turntable");
  set_changes(job.options, to_json(asked.map_options), to_json(drawn.map_options));
  set_changes(job.options, to_json(asked.scatter), to_json(drawn.scatter));
  set_changes(job.options, to_json(asked.picture), to_json(drawn.picture));
  return job;
}

std::filesystem::path frame_path(const std::filesystem::path& sheet, std::size_t number) {
  return sheet.parent_path() /
         fmt::format("{}_{:03}{}", sheet.stem().string(), number, sheet.extension().string());
}

int sheet_columns(int count) {
  if (count <= 5) return count;
  const int least = static_cast<int>(std::ceil(std::sqrt(count)));
  const auto empty = [count](int columns) { return (columns - count % columns) % columns; };
  return std::min({least, least + 1, least + 2}, [&](int a, int b) { return empty(a) < empty(b); });
}

int sheet_reduction(const PictureOptions& options, std::size_t count) {
  constexpr double kMostPixels = 3e8;
  const double pixels = static_cast<double>(count) * options.width * options.height;
  return std::max(1, static_cast<int>(std::ceil(std::sqrt(pixels / kMostPixels))));
}

}  // namespace qjulia::tools
