#include <fmt/format.h>

#include <limits>

#include "base/range_check.hpp"
#include "device/handles.hpp"
#include "map/cost.hpp"
#include "map/device_map.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/map/opencl.hpp"

namespace qjulia {

struct BufferField::Impl {
  map::DeviceMap map;

  std::size_t stride(std::size_t count) const { return map.groups(count) * map.lanes(); }

  /// Launches a kernel of field.cl over points, which writes `arrays` arrays of results.
  /// @param does the kernel, at a point.
  /// @param more arguments between those of the map and the results.
  void launch(const char* kernel, cl_mem points, std::size_t count, const map::PointWork& does,
              const std::vector<device::Argument>& more, const char* name, cl_mem results,
              std::size_t arrays) const {
    constexpr auto kMost = static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max());
    if (count > kMost - map.lanes()) {
      throw OptionError("count", fmt::format("{} are too many; give at most {} at a time", count,
                                             kMost - map.lanes()));
    }
    const std::size_t array = stride(count) * device::real_bytes(map.precision());
    const auto& context = map.context();
    const auto in = device::Handles::borrowed(context, "points", points, 4 * array);
    const auto out = device::Handles::borrowed(context, name, results, arrays * array);
    const std::size_t items = map.groups(count);
    std::vector<device::Argument> all{in, device::narrow(stride(count)), device::narrow(items),
                                      map.buffer(), map.factors()};
    all.insert(all.end(), more.begin(), more.end());
    all.emplace_back(out);
    map.context().launch(map.kernel("field.cl", kernel), {{items, 1, 1}},
                         std::span<const device::Argument>(all),
                         map.work(stride(count), does.slots, does.reals, does.at_most),
                         does.cost * static_cast<double>(stride(count)));
  }
};

BufferField::BufferField(const Device& device, const Map& map, Precision precision,
                         const StopRadii& stops) {
  map.validate();
  impl_ = std::make_shared<Impl>(Impl{{device, map, stops, precision}});
}

std::size_t BufferField::stride(std::size_t count) const { return impl_->stride(count); }

void BufferField::at(cl_mem points, std::size_t count, int iterations, cl_mem field) const {
  base::expect_between("iterations", iterations, 1, kMostIterations);
  impl_->launch("field_at_points", points, count, impl_->map.field_work(iterations),
                {iterations, 0}, "field", field, 1);
}

void BufferField::gradient_at(cl_mem points, std::size_t count, cl_mem gradient) const {
  impl_->launch("field_gradient_at_points", points, count,
                {impl_->map.modulus_cost(), cost::kFieldGradient, 8}, {}, "gradient", gradient, 4);
}

}  // namespace qjulia
