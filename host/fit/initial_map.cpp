#include "fit/initial_map.hpp"

#include <algorithm>
#include <cmath>

#include "qjulia/base/error.hpp"
#include "qjulia/map/detail.hpp"
#include "qjulia/map/field.hpp"

namespace qjulia::fitting {

Map started_from(const Device& device, const Map& given, const Shape& shape,
                 const SamplePool& pool) {
  const ShapeToMap& from = given.frame.shape_to_map;
  const double enlarged = shape.shape_to_map.scale / from.scale;
  Map map;
  map.dynamics.phase = given.dynamics.phase;
  for (const auto& [center, exponent] : given.dynamics.factors) {
    const Eigen::Vector3d x =
        shape.shape_to_map.to_map(from.to_shape({center.x, center.y, center.z}));
    const double w = enlarged * (center.w - given.dynamics.slice);
    map.dynamics.factors.push_back({{x.x(), x.y(), x.z(), w}, exponent});
  }
  // Distances to centres are so many times as large: F stays what it was.
  map.dynamics.log_scale = given.dynamics.log_scale - given.dynamics.surface_level -
                           given.dynamics.degree() * std::log(enlarged);
  map.validate();

  constexpr std::size_t kPoints = 20'000;
  std::vector<Eigen::Vector3d> surface;
  for (std::size_t i = 0; i < std::min(kPoints, pool.surface.size()); ++i) {
    surface.push_back(pool.surface[i].position);
  }
  const double per_slope = shell_thickness(Field(device, map), surface, 0);
  if (!(per_slope > 0 && std::isfinite(per_slope))) {
    throw OptionError("initial",
                      "the map's field does not change about the shape's surface; give a map of "
                      "this shape, with exponents other than 0");
  }
  map.dynamics.log_scale *= per_slope;
  for (Factor& factor : map.dynamics.factors) factor.exponent *= per_slope;
  return map;
}

}  // namespace qjulia::fitting
