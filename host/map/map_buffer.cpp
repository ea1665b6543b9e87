#include "device/handles.hpp"
#include "map/device_map.hpp"
#include "qjulia/map/opencl.hpp"

namespace qjulia {

MapBuffer map_buffer(const Device& device, const Map& map, Precision precision,
                     const StopRadii& stops) {
  map.validate();
  const auto on_device = std::make_shared<map::DeviceMap>(device, map, stops, precision);
  return {.map = device::Handles::of(on_device->buffer()),
          .factors = on_device->factors(),
          .lane_width = device.lane_width(precision),
          .precision = precision,
          .owner = on_device};
}

cl_kernel build_kernel(const Device& device, const Map& map, Precision precision,
                       const std::string& source, const std::string& name) {
  map.validate();
  return device::Handles::build(
      device.context(), source, name,
      {device.lane_width(precision), precision, {}, map::kind_files(map)});
}

}  // namespace qjulia
