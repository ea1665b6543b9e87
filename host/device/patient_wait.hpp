#pragma once
/// Waiting for a device without keeping a core busy.

#include <algorithm>
#include <chrono>
#include <ctime>
#include <memory>
#include <mutex>
#include <thread>

#include "qjulia/device.hpp"

namespace qjulia::device {

/// The total waiting time for a device and its siblings, summed over threads.
class WaitTotal {
 public:
  void add(const WaitTime& more) {
    const std::lock_guard lock(mutex_);
    total_.seconds += more.seconds;
    total_.processor_seconds += more.processor_seconds;
    total_.slept_seconds += more.slept_seconds;
  }
  WaitTime value() const {
    const std::lock_guard lock(mutex_);
    return total_;
  }

 private:
  mutable std::mutex mutex_;
  WaitTime total_;
};

/// The waits of one queue. A driver that has been seen to use the processor while it waits is
/// called only after a sleep of most of the time that the queue is known to need.
class PatientWait {
 public:
  using Clock = std::chrono::steady_clock;

  /// @param may_sleep false for CPUs, whose drivers compute in the waiting thread.
  PatientWait(bool may_sleep, std::shared_ptr<WaitTotal> total)
      : may_sleep_(may_sleep), total_(std::move(total)) {}

  /// Records that a launch with this expected duration has been queued.
  void expect(double seconds) {
    ready_ = std::max(ready_, Clock::now()) +
             std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  }

  /// Calls `wait`, which returns when the queue is empty. Before it sleeps, it calls `flush`, which
  /// passes the queued work to the device. @return what `wait` does.
  template <class Flush, class Wait>
  auto operator()(const Flush& flush, const Wait& wait) {
    const auto begin = Clock::now();
    const double used_before = thread_seconds();
    const double slept = sleep(begin, flush);
    const auto awake = Clock::now();
    const double used_awake = thread_seconds();
    const auto result = wait();
    ready_ = Clock::now();
    const double used = thread_seconds();
    const double waited = seconds(ready_ - awake);
    if (waited > kTellingWait) spins_ = used - used_awake > kBusy * waited;
    total_->add({seconds(ready_ - begin), used - used_before, slept});
    return result;
  }

  /// Whether the last wait that was long enough to tell used the processor.
  bool spins() const { return spins_; }

 private:
  static constexpr double kPart = 0.75;          ///< of the expected time that is slept through
  static constexpr double kLeastSleep = 0.5e-3;  ///< s; a sleep may be late by a tenth of that
  static constexpr double kTellingWait = 1e-3;   ///< s
  static constexpr double kBusy = 0.25;          ///< of a core

  static double seconds(Clock::duration time) {
    return std::chrono::duration<double>(time).count();
  }

  static double thread_seconds() {
    std::timespec time{};
    ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
  }

  template <class Flush>
  double sleep(Clock::time_point begin, const Flush& flush) {
    const double part = kPart * seconds(ready_ - begin);
    if (!may_sleep_ || !spins_ || part < kLeastSleep) return 0;
    flush();
    std::this_thread::sleep_for(std::chrono::duration<double>(part));
    return seconds(Clock::now() - begin);
  }

  bool may_sleep_;
  bool spins_ = false;
  Clock::time_point ready_{};  ///< when the queue is expected to be empty
  std::shared_ptr<WaitTotal> total_;
};

/// Estimates the duration of a kernel's launches from earlier ones.
class LaunchTime {
 public:
  /// Seconds that a launch of this many units is expected to take at least; 0 if unknown.
  double expected(double units) const { return rate_ * units; }
  /// The estimate falls quickly and rises slowly, so that sleeps are not too long.
  void learn(double units, double seconds) {
    if (units <= 0 || seconds <= 0) return;
    const double rate = seconds / units;
    rate_ = rate_ == 0 ? rate : std::min(rate, 0.5 * (rate_ + rate));
  }

 private:
  double rate_ = 0;
};

}  // namespace qjulia::device
