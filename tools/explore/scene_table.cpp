#include "explore/scene_table.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <span>

#include "base/random.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/map/field.hpp"
#include "qjulia/map/knob_table.hpp"
#include "qjulia/map/knobs.hpp"
#include "qjulia/map/slope.hpp"

namespace qjulia::explore {
namespace {

constexpr double kUnbounded = std::numeric_limits<double>::infinity();
/// Spheres on which the field is sampled: their radii, map units.
constexpr double kFirstSphere = 0.05, kSphereRatio = 1.09;
constexpr std::size_t kSpheres = 66;
/// Asked of F against ln r, as find_stop_radii does.
constexpr double kFieldMargin = 0.03;
/// How far ln r_in stays below L, and ln r_out above it.
constexpr double kRadiusToLevel = 1e-5;
/// F_1 - L up to which boxes reach; the page's grid holds the smallest that is large enough.
constexpr std::array kBands{2.5, 3.5, 5.0, 7.0, 10.0, 14.0, 20.0, 28.0, 40.0, 80.0, 320.0};
/// F_1 - L at which slopes are measured.
constexpr std::array kSlopeLevels{-1.0, -0.5, 0.0, 0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0};

/// Divides a knob's range, with a narrow cell about the value that the map has.
std::vector<double> nodes_of(const Control& control, double own, double most, std::size_t count) {
  const double least = std::min(control.least, own), last = std::max(most, own);
  constexpr double kNarrow = 0.004;  // of the range
  std::vector<double> nodes;
  const auto at = [&](double way) {
    return control.is_logarithmic ? least * std::pow(last / least, way)
                                  : std::lerp(least, last, way);
  };
  for (std::size_t i = 0; i <= count; ++i) {
    nodes.push_back(at(static_cast<double>(i) / static_cast<double>(count)));
  }
  const double way = control.is_logarithmic ? std::log(own / least) / std::log(last / least)
                                            : (own - least) / (last - least);
  // Nodes that would be close to it are moved there.
  std::erase_if(nodes, [&](double node) {
    return node > at(way - 6 * kNarrow) && node < at(way + 6 * kNarrow);
  });
  for (const double near : {way - kNarrow, way + kNarrow}) {
    nodes.push_back(at(std::clamp(near, 0.0, 1.0)));
  }
  std::ranges::sort(nodes);
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  return nodes;
}

/// The first control of a knob, or null where the map does not bear the knob.
const Control* control_of(const Map& map, const char* name) {
  const Knob& knob = knob_named(name);
  return knob.why_not(map).empty() ? &knob.controls.front() : nullptr;
}

/// The map whose slopes and radii are measured: steepness comes later, and what holds without
/// paint and portals holds with them.
Map bare(Map map) {
  map.layers.steepness = 1;
  return without_paint(without_portals(std::move(map)));
}

/// Even over the sphere of four dimensions, over the slice's own sphere, and towards centres.
std::vector<Quaternion> probes_of(const Map& map) {
  constexpr std::size_t kSphere = 2048, kSlice = 512, kCenters = 1024;
  base::Random random(1);
  std::vector<Quaternion> probes;
  while (probes.size() < kSphere) {
    const auto some = [&] { return random.uniform(-1, 1); };
    const Quaternion q{some(), some(), some(), some()};
    if (const double size = norm(q); size > 0.1 && size < 1) probes.push_back((1 / size) * q);
  }
  for (std::size_t i = 0; i < kSlice; ++i) {
    Quaternion q = probes[i];
    q.w = 0;
    if (norm(q) > 0) probes.push_back((1 / norm(q)) * q);
  }
  const std::size_t stride = (map.dynamics.factors.size() + kCenters - 1) / kCenters;
  for (std::size_t k = 0; k < map.dynamics.factors.size(); k += stride) {
    const Quaternion& center = map.dynamics.factors[k].center;
    if (norm(center) > 0) probes.push_back((1 / norm(center)) * center);
  }
  return probes;
}

double sphere_radius(std::size_t i) {
  return kFirstSphere * std::pow(kSphereRatio, static_cast<double>(i));
}

/// F_1 - L about the origin of iteration, at one drift and the file's own detail.
struct Profile {
  double level = 0;
  std::array<double, kSpheres> highest{};     ///< in the ball
  std::array<double, kSpheres> lowest{};      ///< on the sphere
  double nearest = kUnbounded, farthest = 0;  ///< of portals' balls
};

Profile profile_of(const Device& device, const Map& drifted, const std::stop_token& stop) {
  const Map map = bare(drifted);
  const Field field(device, map, Precision::single, {0, 0, kUnbounded}, stop);
  const std::vector<Quaternion> probes = probes_of(map);
  std::vector<Quaternion> points;
  for (std::size_t i = 0; i < kSpheres; ++i) {
    for (const Quaternion& probe : probes) points.push_back(sphere_radius(i) * probe);
  }
  // Close to a pole F_1 is high in a neighbourhood that no direction need meet.
  std::vector<Quaternion> poles;
  for (const auto& [center, exponent] : map.dynamics.factors) {
    if (exponent < 0) poles.push_back(center + Quaternion{1e-3, 0, 0, 0});
  }
  const std::vector<double> values = field.at(points), at_poles = field.at(poles);
  Profile profile;
  profile.level = map.dynamics.surface_level;
  double highest = -kUnbounded;
  for (std::size_t i = 0; i < kSpheres; ++i) {
    const auto begin = values.begin() + static_cast<std::ptrdiff_t>(i * probes.size());
    const auto [low, high] =
        std::minmax_element(begin, begin + static_cast<std::ptrdiff_t>(probes.size()));
    highest = std::max(highest, *high - profile.level);
    for (std::size_t k = 0; k < poles.size(); ++k) {
      if (norm(poles[k]) <= sphere_radius(i)) {
        highest = std::max(highest, at_poles[k] - profile.level);
      }
    }
    profile.highest[i] = highest;
    profile.lowest[i] = *low - profile.level;
  }
  for (const Portal& portal : drifted.layers.portals) {
    profile.nearest = std::min(profile.nearest, portal.center.norm() - portal.radius);
    profile.farthest = std::max(profile.farthest, portal.center.norm() + portal.radius);
  }
  return profile;
}

/// The ranges of a cell. F of its maps is L + k max(x, 0) + min(x, 0), x = t (F_1 - L) - ln s, with
/// F_1 at the file's own detail and t times as steep at another.
struct CellRange {
  std::array<double, 2> t, log_scale, steepness;
  std::array<const Profile*, 2> profiles;

  /// F - L at least and at most where F_1 - L is g.
  double least(double g) const { return bent(std::min(t[0] * g, t[1] * g) - log_scale[1], 0); }
  double most(double g) const { return bent(std::max(t[0] * g, t[1] * g) - log_scale[0], 1); }

 private:
  double bent(double x, std::size_t k) const { return x > 0 ? steepness[k] * x : x; }
};

/// The largest sphere that every map of the cell takes into itself, counted from 1; 0 for none.
std::size_t inner_row(const CellRange& cell) {
  const auto holds = [&](std::size_t i) {
    const double radius = sphere_radius(i);
    return std::ranges::all_of(cell.profiles, [&](const Profile* profile) {
      return radius < std::min(profile->nearest, std::exp(profile->level - kRadiusToLevel)) &&
             profile->level + cell.most(profile->highest[i]) <= std::log(radius) - kFieldMargin;
    });
  };
  std::size_t row = kSpheres;
  while (row > 0 && !holds(row - 1)) --row;
  return row;
}

/// A bit more than the radius of the sphere after `i`.
double beyond_sphere(std::size_t i) { return 1.02 * sphere_radius(i + 1); }

/// The first radius beyond which no map of the cell lets a point return; kSpheres - 1 for none.
std::size_t outer_row(const CellRange& cell) {
  const auto leaves = [&](std::size_t i) {
    return std::ranges::all_of(cell.profiles, [&](const Profile* profile) {
      return profile->level + cell.least(profile->lowest[i]) >
             std::log(sphere_radius(i + 1)) + kFieldMargin;
    });
  };
  std::size_t row = kSpheres - 1;
  while (row > 0 && leaves(row)) --row;
  const auto is_beyond_set = [&](const Profile* profile) {
    return beyond_sphere(row) >=
           std::max(profile->farthest, std::exp(profile->level + kRadiusToLevel));
  };
  while (row < kSpheres - 1 && !std::ranges::all_of(cell.profiles, is_beyond_set)) ++row;
  return row;
}

/// The row of kSlopeLevels with the greatest slope among those about a range of F_1 - L.
std::uint8_t steepest_row(double low, double high, std::span<const double> slopes) {
  const auto from = std::ranges::upper_bound(kSlopeLevels, low);
  const auto to = std::ranges::lower_bound(kSlopeLevels, high);
  const auto first = std::max<std::ptrdiff_t>(from - kSlopeLevels.begin() - 1, 0);
  const auto last = std::min<std::ptrdiff_t>(to - kSlopeLevels.begin(), kSlopeLevels.size() - 1);
  const auto most =
      std::max_element(slopes.begin() + first, slopes.begin() + std::max(first, last) + 1);
  return static_cast<std::uint8_t>(most - slopes.begin());
}

/// @param far ln of the radius beyond which orbits are decided.
std::uint8_t band_of(const CellRange& cell, double far) {
  constexpr double kMargin = 1.3, kMost = 6;  // of F - L, beyond which little of the set lies
  const auto [t, most_t] = std::minmax(cell.t[0], cell.t[1]);
  double most = 0;
  for (const Profile* profile : cell.profiles) {
    const double above = std::min(far - profile->level, kMost) + cell.log_scale[1];
    most = std::max(most, kMargin * above / (above > 0 ? t : most_t));
  }
  const auto row = std::ranges::lower_bound(kBands, most);
  return static_cast<std::uint8_t>(
      std::min<std::ptrdiff_t>(row - kBands.begin(), kBands.size() - 1));
}

/// At the level `above` L, as far as steepness k bends it, F_1 - L is so much.
std::array<double, 2> unbent(const CellRange& cell, double above, double most_above) {
  std::array all{(above / cell.steepness[1] + cell.log_scale[0]),
                 (most_above / cell.steepness[0] + cell.log_scale[1])};
  const std::array ends{all[0] / cell.t[0], all[0] / cell.t[1], all[1] / cell.t[0],
                        all[1] / cell.t[1]};
  const auto [low, high] = std::ranges::minmax(ends);
  return {low, high};
}

/// F_1 - L over a slice, on a coarse grid about the shape.
class CoarseSlice {
 public:
  CoarseSlice(const Field& field, const Map& map, double slice) : box_(around(map)) {
    const double longest = box_.size().maxCoeff();
    step_ = longest / kCells;
    for (int axis = 0; axis < 3; ++axis) {
      points_[static_cast<std::size_t>(axis)] =
          static_cast<int>(std::ceil(box_.size()[axis] / step_)) + 1;
    }
    std::vector<Quaternion> all;
    for_points([&](const Eigen::Vector3d& p) { all.push_back({p.x(), p.y(), p.z(), slice}); });
    values_ = field.at(all);
    for (double& value : values_) value -= map.dynamics.surface_level;
  }

  /// What holds the points where F_1 - L is less; of none, the middle.
  Box where_below(double most) const {
    const Eigen::Vector3d margin = Eigen::Vector3d::Constant(1.2 * step_);
    Box found{box_.high, box_.low};
    std::size_t i = 0;
    for_points([&](const Eigen::Vector3d& p) {
      if (!(values_[i++] < most)) return;
      found = {found.low.cwiseMin(p), found.high.cwiseMax(p)};
    });
    if (found.low.x() > found.high.x()) found = {box_.center(), box_.center()};
    return {found.low - margin, found.high + margin};
  }

 private:
  static constexpr int kCells = 32;

  static Box around(const Map& map) {
    const Eigen::Vector3d half = Eigen::Vector3d::Constant(2);
    const Box shape =
        map.frame.box ? map.frame.shape_to_map.to_map(*map.frame.box) : Box{-half, half};
    const Eigen::Vector3d margin = Eigen::Vector3d::Constant(0.35 * shape.size().maxCoeff());
    return {shape.low - margin, shape.high + margin};
  }

  template <class Visit>
  void for_points(const Visit& visit) const {
    for (int k = 0; k < points_[2]; ++k) {
      for (int j = 0; j < points_[1]; ++j) {
        for (int i = 0; i < points_[0]; ++i) {
          visit(box_.low + step_ * Eigen::Vector3d(i, j, k));
        }
      }
    }
  }

  Box box_;
  double step_ = 0;
  std::array<int, 3> points_{};
  std::vector<double> values_;
};

Box both(const Box& a, const Box& b) { return {a.low.cwiseMin(b.low), a.high.cwiseMax(b.high)}; }

/// Slopes at kSlopeLevels; where no point gets to a level, that of the nearest one at which some
/// do.
std::vector<double> slopes_on(const Field& field, const Map& map, double slice, const Box& box) {
  std::vector<std::optional<double>> found;
  found.reserve(kSlopeLevels.size());
  for (const double level : kSlopeLevels) {
    found.push_back(steepest_slope(field, slice, map.dynamics.surface_level + level, box));
  }
  constexpr double kUsual = 10;  // where the slice is empty
  std::vector<double> slopes(found.size(), kUsual);
  for (std::size_t i = 0; i < found.size(); ++i) {
    for (std::size_t away = 0; away < found.size(); ++away) {
      const std::size_t other = i >= away && found[i - away] ? i - away : i + away;
      if (other >= found.size() || !found[other]) continue;
      slopes[i] = *found[other];
      break;
    }
  }
  return slopes;
}

void measure_slices(const Device& device, const Map& map, const std::stop_token& stop,
                    SceneTable& table) {
  const double own = map.dynamics.slice;
  const Control& control = knob_named("slice").controls.front();
  table.slices = {"slice", nodes_of(control, own, control.most, 8)};
  const Map plain = bare(map);
  const Field field(device, plain, Precision::single, {0, 0, kUnbounded}, stop);
  std::vector<std::vector<Box>> boxes;
  std::vector<std::vector<double>> slopes;
  for (const double slice : table.slices.nodes) {
    const CoarseSlice coarse(field, plain, slice);
    std::vector<Box> of_bands;
    for (const double band : kBands) {
      Box box = coarse.where_below(band);
      for (const Portal& portal : map.layers.portals) {
        const Eigen::Vector3d half = Eigen::Vector3d::Constant(portal.radius);
        box = both(box, {portal.center - half, portal.center + half});
      }
      of_bands.push_back(box);
    }
    slopes.push_back(slopes_on(field, plain, slice, of_bands.front()));
    boxes.push_back(std::move(of_bands));
  }
  for (std::size_t cell = 0; cell < table.slices.cells(); ++cell) {
    std::vector<Box>& of_cell = table.boxes.emplace_back(boxes[cell]);
    std::vector<double>& slope = table.slopes.emplace_back(slopes[cell]);
    for (std::size_t i = 0; i < of_cell.size(); ++i) {
      of_cell[i] = both(of_cell[i], boxes[cell + 1][i]);
    }
    for (std::size_t i = 0; i < slope.size(); ++i) {
      slope[i] = std::max(slope[i], slopes[cell + 1][i]);
    }
  }
}

/// The map moved and calibrated; nothing where the origin would leave the shape.
std::optional<Map> drifted(const Device& device, const Map& map, double drift) {
  if (drift == 0) return map;
  MapKnobs knobs;
  knobs.drift = drift;
  try {
    return with_knobs(device, map, knobs);
  } catch (const InputError&) {
    return std::nullopt;
  }
}

/// Levels and profiles over the drift, as far as the origin stays in the shape.
class Drifts {
 public:
  Drifts(const Device& device, const Map& map, const std::stop_token& stop, SceneTable& table)
      : device_(device), map_(map), stop_(stop), table_(table) {
    table_.drifts = {0};
    table_.levels = {map.dynamics.surface_level};
    table_.knobs[1] = {"drift", {0}};
    profiles = {profile_of(device, map, stop)};
    const Control* control = control_of(map, "drift");
    // Where iteration is near the origin, a first short cell has tight radii.
    const std::vector<double> shares{0.04, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1};
    for (std::size_t i = 0; control != nullptr && i < shares.size(); ++i) {
      if (!extend(control->most * shares[i])) break;
    }
    if (profiles.size() > 1) return;
    profiles.push_back(profiles.front());
    table_.knobs[1].nodes.push_back(0);
  }

  std::vector<Profile> profiles;  ///< at the nodes of the table's drift

 private:
  static constexpr int kHalvings = 7;

  /// As far as a drift, or as the origin stays in the shape; whether it is the former.
  bool extend(double drift) {
    std::optional<Map> end = drifted(device_, map_, drift);
    const bool is_inside = end.has_value();
    const double last = table_.drifts.back();
    double inside = last, outside = drift;
    for (int halving = 0; !is_inside && halving < kHalvings; ++halving) {
      const double middle = std::midpoint(inside, outside);
      std::optional<Map> moved = drifted(device_, map_, middle);
      (moved ? inside : outside) = middle;
      if (moved) end = std::move(moved);
    }
    if (!end) return false;
    const double reached = is_inside ? drift : inside;
    refine({last, table_.levels.back()}, {reached, end->dynamics.surface_level}, kHalvings);
    profiles.push_back(profile_of(device_, *end, stop_));
    table_.knobs[1].nodes.push_back(table_.drifts.back());
    return is_inside;
  }

  struct Node {
    double drift, level;
  };

  /// Adds nodes after `from` up to `to` until levels are linear in between.
  void refine(const Node& from, const Node& to, int halvings) {
    const double middle = std::midpoint(from.drift, to.drift);
    const std::optional<Map> moved = halvings > 0 ? drifted(device_, map_, middle) : std::nullopt;
    const double level = moved ? moved->dynamics.surface_level : 0;
    constexpr double kLinear = SceneTable::kLevelError / 2;
    if (moved && std::abs(level - std::midpoint(from.level, to.level)) > kLinear) {
      refine(from, {middle, level}, halvings - 1);
      refine({middle, level}, to, halvings - 1);
    } else {
      table_.drifts.push_back(to.drift);
      table_.levels.push_back(to.level);
    }
  }

  const Device& device_;
  const Map& map_;
  const std::stop_token& stop_;
  SceneTable& table_;
};

/// Of all cells, with the lists that entries name.
void fill_entries(const std::vector<Profile>& profiles, double own_detail, double own_slice,
                  SceneTable& table) {
  table.inner = {0};
  double highest_level = -kUnbounded;
  for (const Profile& profile : profiles) highest_level = std::max(highest_level, profile.level);
  for (std::size_t i = 0; i < kSpheres; ++i) {
    table.inner.push_back(sphere_radius(i));
    table.outer.push_back({beyond_sphere(i), 1.25 * beyond_sphere(i)});
  }
  table.outer.back() = {kUnbounded, std::max(kUsualEscape, 1.25 * std::exp(highest_level))};
  // Slopes of the slice that the map has, in which all levels can be told apart.
  const std::vector<double>& slopes = table.slopes[table.slices.cell_of(own_slice)];
  const auto& [detail, drift, scale, steepness] = table.knobs;
  for (std::size_t a = 0; a < detail.cells(); ++a) {
    for (std::size_t b = 0; b < drift.cells(); ++b) {
      for (std::size_t c = 0; c < scale.cells(); ++c) {
        for (std::size_t d = 0; d < steepness.cells(); ++d) {
          const CellRange cell{{own_detail / detail.nodes[a], own_detail / detail.nodes[a + 1]},
                               {std::log(scale.nodes[c]), std::log(scale.nodes[c + 1])},
                               {steepness.nodes[d], steepness.nodes[d + 1]},
                               {&profiles[b], &profiles[b + 1]}};
          SceneTable::Entry& entry = table.entries.emplace_back();
          entry.inner = static_cast<std::uint8_t>(inner_row(cell));
          entry.outer = static_cast<std::uint8_t>(outer_row(cell));
          const OuterRadii& radii = table.outer[entry.outer];
          const double far = std::log(std::min(radii.outer, radii.escape));
          entry.band = band_of(cell, far);
          const auto [low, high] = std::minmax(profiles[b].level, profiles[b + 1].level);
          const auto [from, to] = unbent(cell, far - high, far - low);
          entry.slope = steepest_row(from, to, slopes);
          const auto [single_from, single_to] = unbent(cell, 0, 0);
          entry.single_slope = steepest_row(single_from, single_to, slopes);
        }
      }
    }
  }
}

}  // namespace

std::size_t KnobNodes::cell_of(double value) const {
  const auto inner_end = nodes.end() - 1;
  return static_cast<std::size_t>(std::upper_bound(nodes.begin() + 1, inner_end, value) -
                                  (nodes.begin() + 1));
}

const SceneTable::Entry& SceneTable::entry_at(double detail, double drift, double scale,
                                              double steepness) const {
  std::size_t at = 0;
  const std::array values{detail, drift, scale, steepness};
  for (std::size_t i = 0; i < knobs.size(); ++i) {
    at = at * knobs[i].cells() + knobs[i].cell_of(values[i]);
  }
  return entries[at];
}

SceneTable scene_table(const Device& device, const Map& map, const std::stop_token& stop) {
  map.validate();
  SceneTable table;
  measure_slices(device, map, stop, table);
  const Drifts drifts(device, map, stop, table);
  const double own_detail = map.frame.detail.value_or(1);
  const Control* detail = control_of(map, "detail");
  table.knobs[0] = {"detail", {own_detail, own_detail}};
  if (detail != nullptr) {
    const double most = std::min(detail->most, knob_named("detail").most_of(map));
    table.knobs[0].nodes = nodes_of(*detail, own_detail, most, 12);
  }
  const Control& scale = knob_named("scale").controls.front();
  table.knobs[2] = {"scale", nodes_of(scale, 1, scale.most, 10)};
  const Control& steepness = knob_named("steepness").controls.front();
  table.knobs[3] = {"steepness", nodes_of(steepness, map.layers.steepness, steepness.most, 5)};
  fill_entries(drifts.profiles, own_detail, map.dynamics.slice, table);
  return table;
}

}  // namespace qjulia::explore
