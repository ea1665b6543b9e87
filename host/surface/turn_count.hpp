#pragma once
/// Counts the turns of a kernel's loop for whoever watches launches (kernels/turns.clh).

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "device/launch_watch.hpp"
#include "map/device_map.hpp"

namespace qjulia::surface {

/// `defines`, and what builds a kernel that counts where anything watches now.
inline std::map<std::string, int> counted_if_watched(std::map<std::string, int> defines = {}) {
  if (device::launch_watch() != nullptr) defines.emplace("QJ_COUNTED", 1);
  return defines;
}

/// The turns of a batch of launches of one kernel.
class TurnCount {
 public:
  /// @param is_counted whether the kernel was built to count. @param items most work-items of a
  /// launch.
  TurnCount(const map::DeviceMap& map, bool is_counted, std::size_t items) : map_(map) {
    if (is_counted) {
      turns_ = map.context().upload<std::int32_t>(std::vector<std::int32_t>(2 * items));
    }
  }

  /// The kernel's last argument, if it counts.
  void append_to(std::vector<device::Argument>& arguments) const {
    if (turns_) arguments.emplace_back(*turns_);
  }

  /// Tells the watch what was counted, when all launches have run.
  void tell(const char* kernel) const {
    device::LaunchWatch* const watch = device::launch_watch();
    if (!turns_ || watch == nullptr) return;
    std::vector<std::int32_t> turns(turns_->size());
    map_.context().read(*turns_, std::span(turns));
    const double pairs = static_cast<double>(map_.lanes()) * map_.factors();
    double slots = 0;
    for (std::size_t i = 0; i < turns.size(); i += 2) {
      slots += pairs * (turns[i] * cost::kLogNorm + turns[i + 1] * cost::kVersorAlone);
    }
    watch->did(kernel, slots);
  }

 private:
  const map::DeviceMap& map_;
  std::optional<device::Buffer<std::int32_t>> turns_;
};

}  // namespace qjulia::surface
