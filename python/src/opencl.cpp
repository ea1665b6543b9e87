/// Queues and buffers of pyopencl, by their addresses.

#include "qjulia/map/opencl.hpp"

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>

#include "keywords.hpp"
#include "map.hpp"
#include "parts.hpp"
#include "unlocked.hpp"

namespace py = pybind11;

namespace qjulia::python {
namespace {

using Address = std::uintptr_t;

template <class Handle>
Handle at_address(Address address) {
  return reinterpret_cast<Handle>(address);  // NOLINT(performance-no-int-to-ptr)
}

OpenDevice device_of_queue(Address context, Address device, Address queue) {
  const Unlocked unlocked;
  return OpenDevice{device_from_opencl(at_address<cl_context>(context),
                                       at_address<cl_device_id>(device),
                                       at_address<cl_command_queue>(queue))};
}

/// The field at points in buffers of the device's context.
class PythonBufferField {
 public:
  PythonBufferField(const KeptMap& map, OpenDevice device, const py::dict& given)
      : device_(std::move(device)) {
    Precision precision = Precision::single;
    StopRadii stops{.escape = kUsualEscape};
    Keywords keywords("BufferField", given);
    keywords.take("precision", precision);
    keywords.take("escape", stops.escape);
    keywords.expect_no_more();
    const DeviceUse use(*device_);
    const Unlocked unlocked;
    field_ = std::make_unique<const BufferField>(device_->device, map.map, precision, stops);
  }

  ~PythonBufferField() {
    destroy_unlocked([&] {
      field_.reset();
      device_.reset();
    });
  }
  PythonBufferField(const PythonBufferField&) = delete;
  PythonBufferField& operator=(const PythonBufferField&) = delete;

  std::size_t stride(const py::object& given) const { return field_->stride(count_of(given)); }

  void at(Address points, const py::object& given, const py::object& n, Address field) const {
    const std::size_t count = count_of(given);
    int iterations = 1;
    read(n, "n", iterations);
    const DeviceUse use(*device_);
    const Unlocked unlocked;
    field_->at(at_address<cl_mem>(points), count, iterations, at_address<cl_mem>(field));
  }

  void gradient_at(Address points, const py::object& given, Address gradient) const {
    const std::size_t count = count_of(given);
    const DeviceUse use(*device_);
    const Unlocked unlocked;
    field_->gradient_at(at_address<cl_mem>(points), count, at_address<cl_mem>(gradient));
  }

 private:
  /// At most 2³¹, so that the stride cannot overflow; the library refuses counts that large.
  static std::size_t count_of(const py::object& given) {
    std::uint64_t count = 0;
    read(given, "count", count);
    constexpr std::uint64_t kMost = std::uint64_t{1} << 31U;
    return static_cast<std::size_t>(std::min(count, kMost));
  }

  std::optional<OpenDevice> device_;  ///< none while it is destroyed
  std::unique_ptr<const BufferField> field_;
};

}  // namespace

void add_opencl(py::module_& module) {
  module.def("device_of_queue", &device_of_queue);
  py::class_<PythonBufferField>(module, "BufferField")
      .def(py::init<const KeptMap&, OpenDevice, const py::dict&>())
      .def("stride", &PythonBufferField::stride)
      .def("at", &PythonBufferField::at)
      .def("gradient_at", &PythonBufferField::gradient_at);
}

}  // namespace qjulia::python
