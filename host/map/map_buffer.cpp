#include "map/map_buffer.hpp"

#include <cmath>

#include "qjulia/shared/map_layout.h"

namespace qjulia {
namespace {

constexpr double kNone = 1e30;    // stands for a logarithm without bound, in any precision
constexpr double kFarAway = 1e6;  // where a factor without effect is near nothing, map units

double log_or(double radius, double otherwise) {
  return radius > 0 && std::isfinite(radius) ? std::log(radius) : otherwise;
}

}  // namespace

std::size_t packed_factors(const RationalMap& map) {
  return map.quadratic ? 1 : map.factors.size();
}

std::vector<double> pack_map(const RationalMap& map, const StopRadii& stops) {
  const std::size_t factors = packed_factors(map);
  const std::size_t stride = QJ_MAP_STRIDE(factors);
  std::vector<double> reals(QJ_MAP_SIZE(factors), 0.0);
  reals[QJ_MAP_LOG_SCALE] = map.log_scale;
  reals[QJ_MAP_SLICE] = map.slice;
  reals[QJ_MAP_PHASE + 0] = map.phase.x;
  reals[QJ_MAP_PHASE + 1] = map.phase.y;
  reals[QJ_MAP_PHASE + 2] = map.phase.z;
  reals[QJ_MAP_PHASE + 3] = map.phase.w;
  reals[QJ_MAP_LOG_ESCAPE] = log_or(stops.escape, kNone);
  reals[QJ_MAP_LOG_INNER] = log_or(stops.inner, -kNone);
  reals[QJ_MAP_LOG_OUTER] = log_or(stops.outer, kNone);
  reals[QJ_MAP_SURFACE_LEVEL] = map.surface_level;
  double* component = reals.data() + QJ_MAP_HEADER;
  if (const auto& c = map.quadratic) {
    reals[QJ_MAP_KIND] = 1;
    reals[QJ_MAP_CONSTANT + 0] = c->x;
    reals[QJ_MAP_CONSTANT + 1] = c->y;
    reals[QJ_MAP_CONSTANT + 2] = c->z;
    reals[QJ_MAP_CONSTANT + 3] = c->w;
    component[QJ_MAP_CENTER_X * stride] = kFarAway;
  }
  for (std::size_t k = 0; k < map.factors.size(); ++k) {
    const auto& [center, exponent] = map.factors[k];
    component[QJ_MAP_EXPONENT * stride + k] = exponent;
    component[QJ_MAP_CENTER_X * stride + k] = center.x;
    component[QJ_MAP_CENTER_Y * stride + k] = center.y;
    component[QJ_MAP_CENTER_Z * stride + k] = center.z;
    component[QJ_MAP_CENTER_W * stride + k] = center.w;
  }
  return reals;
}

device::RealBuffer upload_map(device::Context& context, const RationalMap& map,
                              const StopRadii& stops, Precision precision) {
  return context.upload_real(pack_map(map, stops), precision);
}

}  // namespace qjulia
