#pragma once
/// Where the time of a whole command goes: every kernel that it launched, with the work of its
/// launches against what the device can do at most, and the host's stages beside them.

#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "qjulia/device.hpp"

namespace qjulia {

/// What all launches of one kernel had to do. Slots and bytes are 0 where they are not known.
struct KernelWork {
  std::uint64_t launches = 0;
  double slots = 0;        ///< multiply-adds, multiplications and divisions of the source
  double bytes = 0;        ///< read and written at least
  bool at_most = false;    ///< orbits may have ended before they had done all of it
  bool is_double = false;  ///< computed in double precision
  bool is_known = false;   ///< the library counts this kernel's work
};

/// Counts the work of all launches of this process while it lives, by kernel. While a second
/// counter exists, only the second one counts launches, and it must be destroyed before the first.
class LaunchCounter {
 public:
  LaunchCounter();
  ~LaunchCounter();
  LaunchCounter(const LaunchCounter&) = delete;
  LaunchCounter& operator=(const LaunchCounter&) = delete;
  std::map<std::string, KernelWork> work() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// What bounds kernels on a device, measured.
struct Roofs {
  double fma_per_second = 0;         ///< single precision
  double double_fma_per_second = 0;  ///< double precision; 0 where the device has none
  double bytes_per_second = 0;
};
Roofs measure_roofs(const Device& device);

/// All launches of one kernel.
struct KernelShare {
  std::string kernel;
  std::uint64_t launches = 0;
  double seconds = 0;  ///< on the device
  double share = 0;    ///< of the seconds of all kernels
  KernelWork work;
  std::string limit;  ///< "fma", "memory", or empty where no work is known
  std::optional<double> share_of_limit;
};

/// The host's stages of one name. Stages lie within others.
struct StageShare {
  std::string stage;
  std::uint64_t times = 0;
  double seconds = 0;         ///< wall
  double device_seconds = 0;  ///< of these, the time in which a kernel ran
};

struct CommandProfile {
  DeviceInfo device;
  double seconds = 0;         ///< wall, of the whole command
  double device_seconds = 0;  ///< of these, the time in which a kernel ran
  Roofs roofs;
  std::vector<KernelShare> kernels;  ///< longest first
  std::vector<StageShare> stages;    ///< longest first
};

/// @param trace of the whole command. @param work what its launches had to do.
/// @param seconds wall time of the command.
CommandProfile command_profile(const DeviceInfo& device, const Trace& trace,
                               const std::map<std::string, KernelWork>& work, const Roofs& roofs,
                               double seconds);

nlohmann::json to_json(const CommandProfile& profile);
/// A table for people, lines without an end of line after the last.
std::string to_text(const CommandProfile& profile);

}  // namespace qjulia
