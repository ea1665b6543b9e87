#include "map/device_map.hpp"

#include <algorithm>
#include <cmath>

#include "layout/map_layout.h"
#include "map/kinds.hpp"

namespace qjulia::map {
namespace {

static_assert(kMostIterations == QJ_MOST_ITERATIONS);

constexpr double kNone = 1e30;  // stands for a logarithm without bound, in any precision

double log_or(double radius, double otherwise) {
  return radius > 0 && std::isfinite(radius) ? std::log(radius) : otherwise;
}

void append(std::vector<double>& reals, const Quaternion& q) {
  reals.insert(reals.end(), {q.x, q.y, q.z, q.w});
}

}  // namespace

std::vector<double> pack_map(const RationalMap& map, const StopRadii& stops) {
  const std::size_t factors = map.factors.size();
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
  reals[QJ_MAP_STEEPER] = map.tufts - 1;
  double* component = reals.data() + QJ_MAP_HEADER;
  for (std::size_t k = 0; k < factors; ++k) {
    const auto& [center, exponent] = map.factors[k];
    component[QJ_MAP_EXPONENT * stride + k] = exponent;
    component[QJ_MAP_CENTER_X * stride + k] = center.x;
    component[QJ_MAP_CENTER_Y * stride + k] = center.y;
    component[QJ_MAP_CENTER_Z * stride + k] = center.z;
    component[QJ_MAP_CENTER_W * stride + k] = center.w;
  }
  const auto add = [&](const char* /*name*/, const auto& member) { append(reals, member); };
  reals[QJ_MAP_MODULUS] = static_cast<double>(reals.size());
  visit_members(map.modulus, add);
  reals[QJ_MAP_VERSOR] = static_cast<double>(reals.size());
  visit_members(map.versor, add);
  return reals;
}

DeviceMap::DeviceMap(const Device& device, const RationalMap& map, const StopRadii& stops,
                     Precision precision)
    : device_(device),
      factors_(static_cast<int>(map.factors.size())),
      precision_(precision),
      kinds_{{"QJ_MODULUS", name_of(map.modulus) + "_modulus.clh"},
             {"QJ_VERSOR", name_of(map.versor) + "_versor.clh"}},
      slice_(map.slice) {
  for (const Factor& factor : map.factors) centers_.push_back(factor.center);
  const auto packed = pack_map(map, stops);
  buffer_ = context().upload_real(packed, precision);
  log_inner_ = packed[QJ_MAP_LOG_INNER];
  log_outer_ = std::min(packed[QJ_MAP_LOG_ESCAPE], packed[QJ_MAP_LOG_OUTER]);
}

device::Kernel DeviceMap::kernel(const char* file, const char* name) const {
  return context().kernel(file, name, {device_.lane_width(precision_), precision_, {}, kinds_});
}

std::size_t DeviceMap::lanes() const {
  return static_cast<std::size_t>(device_.lane_width(precision_));
}

}  // namespace qjulia::map
