#include "surface/device_map.hpp"

#include <algorithm>

#include "map/map_buffer.hpp"
#include "qjulia/shared/map_layout.h"

namespace qjulia {

DeviceMap::DeviceMap(const Device& device, const RationalMap& map, const StopRadii& stops,
                     Precision precision)
    : device_(device),
      factors_(static_cast<int>(packed_factors(map))),
      precision_(precision),
      slice_(map.slice) {
  for (const Factor& factor : map.factors) centers_.push_back(factor.center);
  const auto packed = pack_map(map, stops);
  buffer_ = context().upload_real(packed, precision);
  log_inner_ = packed[QJ_MAP_LOG_INNER];
  log_outer_ = std::min(packed[QJ_MAP_LOG_ESCAPE], packed[QJ_MAP_LOG_OUTER]);
}

device::Kernel DeviceMap::kernel(const char* file, const char* name) const {
  return context().kernel(file, name, {device_.lane_width(precision_), precision_, {}});
}

std::size_t DeviceMap::lanes() const {
  return static_cast<std::size_t>(device_.lane_width(precision_));
}

std::size_t DeviceMap::groups_per_launch(std::size_t pairs) const {
  return std::max<std::size_t>(1, pairs / (lanes() * static_cast<std::size_t>(factors_)));
}

}  // namespace qjulia
