#include "device.hpp"

#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "keywords.hpp"
#include "qjulia/device/tuning_cache.hpp"
#include "unlocked.hpp"

namespace py = pybind11;

namespace qjulia::python {
namespace {

/// The device, with the settings that were tuned for it, as the command takes it; and a warning.
py::tuple opened(const std::string& name, const std::string& layout, bool tuned) {
  CachedTuning found = [&] {
    const Unlocked unlocked;
    Device device = Device::choose({name, layout});
    return tuned ? with_cached_tuning(device) : CachedTuning{std::move(device), ""};
  }();
  return py::make_tuple(OpenDevice{std::move(found.device)}, found.warning);
}

/// How Python lets go of a device: that of a queue of pyopencl's waits for the queue.
struct UnlockedDelete {
  void operator()(OpenDevice* device) const {
    destroy_unlocked([&] { delete std::exchange(device, nullptr); });
  }
};

std::string list_text() {
  const Unlocked unlocked;
  nlohmann::json all = nlohmann::json::array();
  for (const DeviceInfo& info : list_devices()) all.push_back(to_json(info));
  return all.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
}

}  // namespace

DeviceUse::DeviceUse(const OpenDevice& device) : in_use_(device.in_use) {
  // A lock that another thread held when this process was forked is never released here.
  device.device.expect_own_process();
  if (in_use_->try_lock()) return;
  while (true) {
    bool is_mine = false;
    {
      const Unlocked unlocked;
      is_mine = in_use_->try_lock_for(kBetweenLooks);
    }
    if (is_mine) return;
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
  }
}

void add_device(py::module_& module) {
  py::class_<OpenDevice, std::unique_ptr<OpenDevice, UnlockedDelete>>(module, "Device")
      .def_property_readonly("info",
                             [](const OpenDevice& self) {
                               return to_json(self.device.info())
                                   .dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
                             })
      .def_property_readonly(
          "layout", [](const OpenDevice& self) { return to_string(self.device.layout()); });
  module.def("open_device", &opened);
  module.def("list_devices", &list_text);
}

}  // namespace qjulia::python
