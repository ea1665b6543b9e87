#include "picture_sweep.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>

#include "base/text.hpp"
#include "files.hpp"
#include "provenance.hpp"
#include "qjulia/error.hpp"
#include "qjulia/knob_table.hpp"
#include "qjulia/picture_settings.hpp"

namespace qjulia::tools {
namespace {

constexpr int kMostFrames = 10000;

/// Sets the option. @throws InputError for a value that it cannot have.
using Setter = std::function<void(double, MapOptions&, PictureOptions&)>;
using Setters = std::map<std::string, Setter>;

/// cos A + u sin A, for a unit vector along `axis` (1: i, 2: j, 3: k) and A in degrees.
Quaternion turned_phase(int axis, double degrees) {
  const double angle = degrees * std::numbers::pi / 180;
  Quaternion phase{std::cos(angle), 0, 0, 0};
  (axis == 1 ? phase.y : axis == 2 ? phase.z : phase.w) = std::sin(angle);
  return phase;
}

double whole(double value) {
  if (value == std::round(value) && std::abs(value) <= 1e9) return value;
  throw InputError(fmt::format("{} is not a whole number", value));
}

/// Adds each part of a setting that can be swept: its number, or the angle of a turn about each
/// axis.
class SweepOf {
 public:
  using Place = std::function<ValuePlace(MapOptions&, PictureOptions&)>;
  SweepOf(const Setting& setting, Place place, Setters& setters)
      : setting_(setting), place_(std::move(place)), setters_(setters) {}

  template <class Number>
  requires std::is_floating_point_v<Number>
  void operator()(Number*) const { add_number(); }
  void operator()(std::optional<double>*) const { add_number(); }
  void operator()(std::optional<std::uint64_t>*) const {
    setters_[setting_.option()] = [&setting = setting_, place = place_](double v, MapOptions& m,
                                                                        PictureOptions& p) {
      setting.expect_in_range(whole(v));
      *std::get<std::optional<std::uint64_t>*>(place(m, p)) = static_cast<std::uint64_t>(v);
    };
  }
  void operator()(std::optional<Quaternion>*) const {
    for (const int axis : {1, 2, 3}) {
      setters_[fmt::format("{}-{}", setting_.option(), "-ijk"[axis])] =
          [place = place_, axis](double v, MapOptions& m, PictureOptions& p) {
            *std::get<std::optional<Quaternion>*>(place(m, p)) = turned_phase(axis, v);
          };
    }
  }
  template <class Other>
  void operator()(const Other&) const {}

 private:
  void add_number() const {
    setters_[setting_.option()] = [&setting = setting_, place = place_](double v, MapOptions& m,
                                                                        PictureOptions& p) {
      setting.expect_in_range(v);
      const ValuePlace value = place(m, p);
      if (auto* const* number = std::get_if<double*>(&value)) {
        **number = v;
      } else {
        *std::get<std::optional<double>*>(value) = v;
      }
    };
  }

  const Setting& setting_;
  Place place_;
  Setters& setters_;
};

const Setters& setters() {
  static const Setters all = [] {
    Setters made;
    MapOptions map_options;
    PictureOptions options;
    const auto add = [&](const Setting& setting, const SweepOf::Place& place) {
      std::visit(SweepOf(setting, place, made), place(map_options, options));
    };
    for (const Knob& knob : knob_table()) {
      add(knob, [&knob](MapOptions& m, PictureOptions&) { return knob.place(m.knobs); });
    }
    for (const PictureSetting& setting : picture_settings()) {
      add(setting, [&setting](MapOptions&, PictureOptions& p) { return setting.place(p); });
    }
    made["iterations"] = [](double v, MapOptions&, PictureOptions& p) {
      p.iterations = static_cast<int>(whole(v));
    };
    return made;
  }();
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

/// How the option goes from one value to another; linearly unless a table says otherwise.
Interpolation interpolation_of(const std::string& option) {
  for (const Knob& knob : knob_table()) {
    if (knob.option() == option) return knob.interpolation;
  }
  for (const PictureSetting& setting : picture_settings()) {
    if (setting.option() == option) return setting.interpolation;
  }
  return Interpolation::linear;
}

/// The options that go by equal ratios, for help.
std::string names_of_ratios() {
  std::vector<std::string> names;
  for (const auto& [name, setter] : setters()) {
    if (interpolation_of(name) == Interpolation::logarithmic) names.push_back(name);
  }
  return fmt::format("{}", fmt::join(names, ", "));
}

/// "NAME=FROM:TO:COUNT", both ends included and by equal steps or ratios, or "NAME=A,B,C". @throws
/// InputError
Sweep parse_sweep(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos) throw unreadable(text);
  Sweep sweep{text.substr(0, equals), {}};
  if (!setters().contains(sweep.name)) {
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
      interpolation_of(sweep.name) == Interpolation::logarithmic && range[0] > 0 && range[1] > 0;
  for (int i = 0; i < count; ++i) {
    const double way = double(i) / (count - 1);
    sweep.values.push_back(has_equal_ratios && i > 0 && i + 1 < count
                               ? range[0] * std::pow(range[1] / range[0], way)
                               : std::lerp(range[0], range[1], way));
  }
  return sweep;
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

void Sweep::set(double value, MapOptions& map_options, PictureOptions& options) const {
  setters().at(name)(value, map_options, options);
}

bool Sweep::is_of_camera() const {
  const auto found = std::ranges::find_if(
      picture_settings(), [&](const auto& setting) { return setting.option() == name; });
  return found != picture_settings().end() && found->is_of_camera;
}

std::string sweep_names() {
  std::vector<std::string> names;
  for (const auto& [name, setter] : setters()) names.push_back(name);
  return fmt::format(
      "{}; phase-i is the phase cos A + i sin A, A in degrees. From FROM to TO, {} go by equal "
      "ratios, the others by equal steps",
      fmt::join(names, ", "), names_of_ratios());
}

std::optional<Sweep> wanted_sweep(const SweepChoice& wanted, const std::string& input,
                                  const MapOptions& given, const std::vector<Option>& camera,
                                  const PictureOptions& options) {
  if (wanted.sweep && wanted.turntable) {
    throw InputError("give either --sweep or --turntable");
  }
  if (wanted.turntable) return turntable(options.camera.azimuth, *wanted.turntable);
  if (!wanted.sweep) return std::nullopt;
  Sweep sweep = parse_sweep(*wanted.sweep);
  const bool is_phase = sweep.name.starts_with("phase-");
  expect_not_given(camera, given, is_phase ? "--phase" : "--" + sweep.name);
  // Refused before the first picture is drawn, not after some.
  for (const double value : sweep.values) {
    MapOptions map_options = given;
    PictureOptions changed = options;
    try {
      sweep.set(value, map_options, changed);
    } catch (const InputError& error) {
      throw InputError(fmt::format("--sweep {}: {}", sweep.name, error.what()));
    }
    map_options.knobs.validate();
    changed.validate();
  }
  if (!sweep.is_of_camera()) expect_map("--sweep " + sweep.name, input);
  return sweep;
}

Job frame_job(Job job, const View& asked, const View& drawn) {
  job.options.erase("sweep");
  job.options.erase("turntable");
  set_changes(job.options, to_json(asked.map_options), to_json(drawn.map_options));
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
