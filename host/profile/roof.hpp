#pragma once
/// What share of a device's limits a kernel reached.

#include <algorithm>
#include <optional>
#include <string>

#include "qjulia/command_profile.hpp"

namespace qjulia::profiling {

struct Roof {
  std::string limit;            ///< "fma" or "memory"; empty where no work is known
  std::optional<double> share;  ///< of what the device can do in the time
};

/// Of work that took so many seconds: whichever limit would take longer for it.
inline Roof roof_of(const KernelWork& work, double seconds, const Roofs& roofs) {
  const double rate = work.is_double ? roofs.double_fma_per_second : roofs.fma_per_second;
  const double by_fma = work.slots > 0 && rate > 0 ? work.slots / rate : 0;
  const double by_memory =
      work.bytes > 0 && roofs.bytes_per_second > 0 ? work.bytes / roofs.bytes_per_second : 0;
  if (!(seconds > 0) || (by_fma == 0 && by_memory == 0)) return {};
  return {by_fma >= by_memory ? "fma" : "memory", std::max(by_fma, by_memory) / seconds};
}

}  // namespace qjulia::profiling
