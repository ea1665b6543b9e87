#pragma once
/// The CPU time of the threads that run kernels, where the device is a CPU. Other programs make a
/// kernel take longer, but do not change its CPU time.

#include <chrono>
#include <condition_variable>
#include <ctime>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "qjulia/base/trace.hpp"
#include "qjulia/device/device.hpp"

namespace qjulia::profiling {

#ifdef __linux__
/// The clock of the CPU time of a thread of this process.
clockid_t cpu_clock_of(int thread);
#endif

/// The threads of a driver, and what the system says about them. Threads that start later, such as
/// the program's own helpers, are not counted.
class WorkerClock {
 public:
  /// @param probe runs a kernel that uses the whole device, so that the driver starts its threads.
  /// The calling thread is one of them if the driver computes in it.
  /// @return null on devices other than CPUs, and where the system does not say what threads use.
  static std::shared_ptr<const WorkerClock> of(const Device& device,
                                               const std::function<void()>& probe);

  /// Their numbers, as the system gives them.
  const std::vector<int>& threads() const { return threads_; }

  /// CPU seconds of all threads so far.
  double seconds() const;
  /// Seconds in which they were ready to run and waited for a processor; none where the system does
  /// not say.
  std::optional<double> waited_seconds() const;

 private:
  explicit WorkerClock(std::vector<int> threads) : threads_(std::move(threads)) {}

  std::vector<int> threads_;
  mutable std::mutex reading_;
  mutable std::map<int, double> latest_;  ///< a thread that has ended keeps its seconds
};

/// The share of their time in which threads waited for a processor; none where it is not known.
class WaitedShare {
 public:
  explicit WaitedShare(std::shared_ptr<const WorkerClock> clock);
  std::optional<double> so_far() const;

 private:
  std::shared_ptr<const WorkerClock> clock_;
  double seconds_ = 0;
  std::optional<double> waited_;
};

/// A clock's CPU seconds at a time.
struct CpuSample {
  Trace::Clock::time_point time;
  double seconds = 0;
};

/// Reads a clock every two milliseconds as long as it lives; where there are too many samples, it
/// drops every other one and reads half as often.
class CpuSampler {
 public:
  explicit CpuSampler(std::shared_ptr<const WorkerClock> clock);
  ~CpuSampler();
  CpuSampler(const CpuSampler&) = delete;
  CpuSampler& operator=(const CpuSampler&) = delete;

  /// All samples, with one of now.
  std::vector<CpuSample> samples() const;

 private:
  void add_sample();

  std::shared_ptr<const WorkerClock> clock_;
  mutable std::mutex adding_;
  std::vector<CpuSample> samples_;
  std::chrono::milliseconds period_{2};
  std::condition_variable_any ended_;
  std::jthread thread_;
};

/// When a kernel ran, by the host's clock.
struct KernelSpan {
  Trace::Clock::time_point start;
  std::chrono::nanoseconds length{};
};

/// The CPU seconds of each kernel. What was used between two samples is divided among the kernels
/// that ran then, by the time for which they did. What was used while none ran belongs to none, and
/// a kernel has not used more than all processors in its time: the rest is the driver's.
/// @param samples in order of their time. @param processors of the device.
std::vector<double> cpu_seconds_of(const std::vector<KernelSpan>& kernels,
                                   const std::vector<CpuSample>& samples, unsigned processors);

}  // namespace qjulia::profiling
