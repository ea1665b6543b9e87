#include "qjulia/detail.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "qjulia/error.hpp"

namespace qjulia {
namespace {

void expect_points(std::span<const Eigen::Vector3d> surface) {
  if (surface.empty()) throw InputError("there are no points of the surface to measure at");
}

}  // namespace

RationalMap steepened(const RationalMap& map, double t) {
  map.validate();
  if (!(t > 0 && std::isfinite(t))) {
    throw InputError(
        fmt::format("a map cannot be made {} times as steep: give a positive number", t));
  }
  RationalMap result = map;
  if (auto* distance = std::get_if<DistanceModulus>(&result.modulus)) {
    distance->shell /= t;
  } else {
    for (Factor& factor : result.factors) factor.exponent *= t;
  }
  result.log_scale = t * (map.log_scale - map.surface_level) + map.surface_level;
  if (result.detail) *result.detail /= t;
  return result;
}

RationalMap with_detail(const RationalMap& map, double detail) {
  map.validate();
  if (!(std::isfinite(detail) && detail > 0)) {
    throw OptionError("detail", fmt::format("{} is out of range; give a positive fraction of the "
                                            "box's diagonal, such as 0.02",
                                            detail));
  }
  if (!map.detail) {
    throw OptionError("detail",
                      "the map does not say its own \"detail\"; fit it again, or add that key to "
                      "the file");
  }
  RationalMap result = steepened(map, *map.detail / detail);
  result.detail = detail;
  if (result.degree() > 1) return result;
  if (map.degree() <= 0) {
    throw InputError(fmt::format(
        "the map's exponents sum to {}: no detail bounds its set; fit it again", map.degree()));
  }
  throw OptionError(
      "detail", fmt::format("{} is too large for this map: its exponents would sum to {}, and they "
                            "must exceed 1; use less than {}",
                            detail, result.degree(), *map.detail * map.degree()));
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

RationalMap with_measured_detail(const Device& device, RationalMap map,
                                 std::span<const Eigen::Vector3d> surface) {
  if (!map.box) throw InputError("the map does not say the shape's \"box\": fit it again");
  const double diagonal = map.shape_to_map.scale * map.box->diagonal();
  map.detail = shell_thickness(Field(device, map), surface, map.slice) / diagonal;
  return map;
}

}  // namespace qjulia
