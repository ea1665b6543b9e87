#pragma once
/// Where the time of a whole command goes: every kernel that it launched, with the work of its
/// launches against what the device can do at most, and the host's stages beside them.

#include <cstdint>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "qjulia/base/trace.hpp"
#include "qjulia/device/device.hpp"
#include "qjulia/device/launch_size.hpp"
#include "qjulia/profile/cache_roof.hpp"
#include "qjulia/profile/instruction_mix.hpp"
#include "qjulia/profile/processor_use.hpp"

namespace qjulia::profiling {

/// What all launches of one kernel had to do. Slots and bytes are 0 where they are not known.
struct KernelWork {
  std::uint64_t launches = 0;
  double slots = 0;        ///< multiply-adds, multiplications and divisions of the source
  double bytes = 0;        ///< read and written at least
  bool at_most = false;    ///< orbits may have ended before they had done all of it
  bool is_double = false;  ///< computed in double precision
  std::optional<LaunchSizes> sizes{};
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
  /// Multiply-adds and bytes in a CPU second of the threads that run kernels; 0 where these seconds
  /// are not known.
  double fma_per_cpu_second = 0;
  double double_fma_per_cpu_second = 0;
  double bytes_per_cpu_second = 0;
  /// Nearest first. Empty on other devices than CPUs, and where the system does not say how large
  /// its caches are.
  std::vector<CacheRoof> caches{};
};
Roofs measure_roofs(const Device& device);

/// What a meter measured before, during and after a command.
struct CommandMeasure {
  Roofs roofs;  ///< after it
  /// Multiply-adds in single precision, before the command; 0 where they were not measured.
  double fma_per_second_before = 0;
  double fma_per_cpu_second_before = 0;
  /// CPU seconds that the threads that run kernels have used up to a time, which is in nanoseconds
  /// since the trace began; in order of time. Empty where they are not known, as on GPUs.
  struct Cpu {
    std::int64_t time = 0;
    double seconds = 0;
  };
  std::vector<Cpu> cpu;
  /// The share of their time in which these threads were ready to run and waited for a processor.
  std::optional<double> waited_share;
  std::optional<ProcessorUse> use{};  ///< of the processors, from before the command to its end
  /// Of kernels by name, on CPUs whose driver keeps its machine code as files.
  std::map<std::string, InstructionMix> instructions;
  std::string
      no_instructions;  ///< why there are none, and what to do; empty where nothing is wrong
};

/// Measures the limits of a command's device and, on CPUs, the CPU time of the threads that run
/// kernels. If the device keeps a trace, the meter's own launches would be in it: make the meter
/// before the trace begins, and finish it after the trace ends.
class CommandMeter {
 public:
  /// Measures the multiply-adds. @throws Interrupted
  explicit CommandMeter(const Device& device, const std::stop_token& stop = {});
  ~CommandMeter();
  CommandMeter(const CommandMeter&) = delete;
  CommandMeter& operator=(const CommandMeter&) = delete;
  CommandMeasure finish(Trace::Clock::time_point trace_began) const;  ///< measures the roofs

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// All launches of one kernel.
struct KernelShare {
  std::string kernel;
  std::uint64_t launches = 0;
  double seconds = 0;  ///< on the device
  double share = 0;    ///< of the seconds of all kernels
  /// CPU seconds of the threads that ran it, where they are known. They are sampled, and divided
  /// among the kernels that ran between two samples in proportion to their time.
  std::optional<double> cpu_seconds;
  KernelWork work;
  std::optional<LaunchSizes> sizes;
  std::string limit;  ///< "fma", "memory", or empty where no work is known
  /// Share of the multiply-adds possible in its CPU seconds where these are known, else in its
  /// seconds; or of the bytes possible in its seconds. Empty unless the verdict is "judged".
  std::optional<double> share_of_limit;
  /// The share of the higher and of the lower of the limits before and after the command, also
  /// where the verdict is "not now".
  std::optional<double> share_low, share_high;
  std::string share_verdict;  ///< as in KernelFigures (profile.hpp)
  std::optional<InstructionMix> instructions;
  std::string limited_by;  ///< what limits it, in words; empty where nothing is known
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
  CommandMeasure measure;
  std::vector<KernelShare> kernels;  ///< longest first
  std::vector<StageShare> stages;    ///< longest first

  /// Signs that other work disturbed the command, a sentence each; none on an idle machine.
  std::vector<std::string> disturbances() const;
};

/// @param trace of the whole command. @param work what its launches had to do.
/// @param seconds wall time of the command.
CommandProfile command_profile(const DeviceInfo& device, const Trace& trace,
                               const std::map<std::string, KernelWork>& work,
                               const CommandMeasure& measure, double seconds);

nlohmann::json to_json(const CommandProfile& profile);
/// A table for people, lines without an end of line after the last.
std::string to_text(const CommandProfile& profile);

}  // namespace qjulia::profiling
