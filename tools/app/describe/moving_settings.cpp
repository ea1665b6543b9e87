#include "describe/moving_settings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "qjulia/base/error.hpp"
#include "qjulia/map/knob_table.hpp"
#include "qjulia/picture/picture_settings.hpp"

namespace qjulia::tools {
namespace {

using Settings = std::map<std::string, MovingSetting, std::less<>>;
using Numbers = std::span<const double>;

double whole(double value) {
  if (value == std::round(value) && std::abs(value) <= 1e9) return value;
  throw InputError(fmt::format("{} is not a whole number", value));
}

/// cos A + u sin A, for a unit vector along `axis` (1: i, 2: j, 3: k) and A in degrees.
Quaternion turned_phase(int axis, double degrees) {
  const double angle = degrees * std::numbers::pi / 180;
  Quaternion phase{std::cos(angle), 0, 0, 0};
  (axis == 1 ? phase.y : axis == 2 ? phase.z : phase.w) = std::sin(angle);
  return phase;
}

/// Adds a setting, and parts of it, if its values are numbers.
class Adder {
 public:
  using Place = std::function<ValuePlace(View&)>;
  Adder(const Setting& setting, bool is_of_map, Place place, Settings& all)
      : setting_(setting), is_of_map_(is_of_map), place_(std::move(place)), all_(all) {}

  void operator()(double*) const {
    add<double*>(1, [](Numbers v, double* value) { *value = v[0]; });
  }
  void operator()(std::optional<double>*) const {
    add<std::optional<double>*>(1, [](Numbers v, auto* value) { *value = v[0]; });
  }
  void operator()(std::optional<std::uint64_t>*) const {
    add<std::optional<std::uint64_t>*>(
        1, [](Numbers v, auto* value) { *value = static_cast<std::uint64_t>(whole(v[0])); });
  }
  void operator()(std::optional<Eigen::Vector3d>*) const {
    add<std::optional<Eigen::Vector3d>*>(
        3, [](Numbers v, auto* value) { *value = Eigen::Vector3d(v[0], v[1], v[2]); });
  }
  void operator()(std::optional<Rotation>*) const {
    add<std::optional<Rotation>*>(4, [](Numbers v, auto* value) {
      *value = Rotation{{v[0], v[1], v[2]}, v[3]};
    });
  }
  void operator()(std::optional<Box>*) const {
    add<std::optional<Box>*>(6, [](Numbers v, auto* value) {
      *value = Box{{v[0], v[1], v[2]}, {v[3], v[4], v[5]}};
    });
  }
  void operator()(std::optional<Quaternion>*) const {
    using Target = std::optional<Quaternion>*;
    add<Target>(4, [](Numbers v, auto* value) { *value = Quaternion{v[0], v[1], v[2], v[3]}; });
    for (const int axis : {1, 2, 3}) {
      add<Target>(
          1, [axis](Numbers v, auto* value) { *value = turned_phase(axis, v[0]); },
          fmt::format("-{}", "-ijk"[axis]), Interpolation::linear);
    }
  }
  template <class Other>
  void operator()(const Other&) const {}

 private:
  template <class Target, class Give>
  void add(std::size_t numbers, Give give, const std::string& part = {},
           std::optional<Interpolation> interpolation = {}) const {
    const auto set = [&setting = setting_, place = place_, give](Numbers v, View& view) {
      if (v.size() == 1) setting.expect_in_range(v[0]);
      give(v, std::get<Target>(place(view)));
    };
    all_[setting_.option() + part] = {setting_.option(), numbers,
                                      interpolation.value_or(setting_.interpolation), is_of_map_,
                                      set};
  }

  const Setting& setting_;
  bool is_of_map_;
  Place place_;
  Settings& all_;
};

/// Cuts the set open across the axis, at so many per cent of its box.
void set_cut(char axis, double percent, View& view) {
  std::vector<Cut>& cuts = view.picture.cuts;
  const auto found = std::ranges::find(cuts, axis, &Cut::axis);
  (found == cuts.end() ? cuts.emplace_back() : *found) = {axis, percent, true};
}

Settings made_settings() {
  Settings made;
  View view;
  for (const Knob& knob : knob_table()) {
    const Adder::Place place = [&knob](View& v) { return knob.place(v.map_options.knobs); };
    std::visit(Adder(knob, true, place, made), place(view));
  }
  for (const PictureSetting& setting : picture_settings()) {
    const Adder::Place place = [&setting](View& v) { return setting.place(v.picture); };
    const bool is_of_map = !setting.is_of_camera && !setting.is_of_look;
    std::visit(Adder(setting, is_of_map, place, made), place(view));
  }
  made["iterations"] = {"iterations", 1, Interpolation::none, true, [](Numbers v, View& to) {
                          to.picture.iterations = static_cast<int>(whole(v[0]));
                        }};
  made["scatter-time"] = {"scatter-time", 1, Interpolation::linear, true, [](Numbers v, View& to) {
                            if (!to.scatter.field)
                              throw InputError("nothing flies; give the option scatter, too");
                            if (!(v[0] >= 0 && v[0] <= 600))
                              throw InputError(fmt::format("{} seconds; give 0 to 600", v[0]));
                            to.scatter.time = v[0];
                          }};
  for (const char axis : {'x', 'y', 'z'}) {
    made[fmt::format("cut-{}", axis)] = {"cut", 1, Interpolation::linear, true,
                                         [axis](Numbers v, View& to) { set_cut(axis, v[0], to); }};
  }
  return made;
}

}  // namespace

const Settings& moving_settings() {
  static const Settings all = made_settings();
  return all;
}

}  // namespace qjulia::tools
