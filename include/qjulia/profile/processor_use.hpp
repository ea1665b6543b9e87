#pragma once
/// Who else had this machine's processors while something was measured.

#include <cstdint>

namespace qjulia {

/// Processors are mean numbers of them over the time.
struct ProcessorUse {
  double seconds = 0;  ///< on the wall
  int processors = 0;  ///< that the machine has
  double others = 0;   ///< of these, what other programs had
  double stolen = 0;   ///< and what the host of a virtual machine kept for itself
  /// How often, and for how many seconds, the system stopped this program because its group had
  /// used up its quota of processors.
  std::uint64_t throttled_times = 0;
  double throttled_seconds = 0;
};

}  // namespace qjulia
