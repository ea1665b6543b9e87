#include "qjulia/map/detail.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "qjulia/base/error.hpp"

namespace qjulia {
namespace {

void expect_points(std::span<const Eigen::Vector3d> surface) {
  if (surface.empty()) throw InputError("there are no points of the surface to measure at");
}

}  // namespace

Map steepened(const Map& map, double t) {
  map.validate();
  if (!(t > 0 && std::isfinite(t))) {
    throw InputError(
        fmt::format("a map cannot be made {} times as steep: give a positive number", t));
  }
  Map result = map;
  if (auto* distance = std::get_if<DistanceModulus>(&result.dynamics.modulus)) {
    distance->shell /= t;
  } else {
    for (Factor& factor : result.dynamics.factors) factor.exponent *= t;
  }
  result.dynamics.log_scale =
      t * (map.dynamics.log_scale - map.dynamics.surface_level) + map.dynamics.surface_level;
  if (result.frame.detail) *result.frame.detail /= t;
  result.validate();  // a huge or tiny number makes others that no map may have
  return result;
}

Map with_detail(const Map& map, double detail) {
  map.validate();
  if (!(std::isfinite(detail) && detail > 0)) {
    throw OptionError("detail", fmt::format("{} is out of range; give a positive fraction of the "
                                            "box's diagonal, such as 0.02",
                                            detail));
  }
  if (!map.frame.detail) {
    throw OptionError("detail",
                      "the map does not say its own \"detail\"; fit it again, or add that key to "
                      "the file");
  }
  Map result = steepened(map, *map.frame.detail / detail);
  result.frame.detail = detail;
  if (result.dynamics.degree() > 1) return result;
  if (map.dynamics.degree() <= 0) {
    throw InputError(
        fmt::format("the map's exponents sum to {}: no detail bounds its set; fit it again",
                    map.dynamics.degree()));
  }
  throw OptionError(
      "detail",
      fmt::format("{} is too large for this map: its exponents would sum to {}, and they "
                  "must exceed 1; use less than {}",
                  detail, result.dynamics.degree(), *map.frame.detail * map.dynamics.degree()));
}

double shell_thickness(const Field& field, std::span<const Eigen::Vector3d> surface, double slice) {
  expect_points(surface);
  double sum = 0;
  for (const Quaternion& g : field.gradient_at(on_slice(surface, slice))) {
    sum += std::hypot(g.x, g.y, g.z);
  }
  return static_cast<double>(surface.size()) / sum;
}

double median_level(const Field& field, std::span<const Eigen::Vector3d> surface, double slice) {
  expect_points(surface);
  std::vector<double> levels = field.at(on_slice(surface, slice));
  const auto middle = levels.begin() + static_cast<std::ptrdiff_t>(levels.size() / 2);
  std::ranges::nth_element(levels, middle);
  return *middle;
}

Map with_measured_detail(const Device& device, Map map, std::span<const Eigen::Vector3d> surface) {
  const std::optional<double> own = map.frame.own_diagonal();
  if (!own) throw InputError("the map does not say the shape's \"box\": fit it again");
  const double diagonal = map.frame.shape_to_map.scale * *own;
  map.frame.detail = shell_thickness(Field(device, map), surface, map.dynamics.slice) / diagonal;
  map.validate();  // where the field is flat, nothing was measured
  return map;
}

}  // namespace qjulia
