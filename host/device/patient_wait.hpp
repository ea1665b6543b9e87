#pragma once
/// Waiting for a device without keeping a core busy.

#include <algorithm>
#include <chrono>
#include <ctime>
#include <memory>
#include <mutex>
#include <thread>

#include "qjulia/device/device.hpp"

namespace qjulia::device {

/// The total waiting time for a device and its siblings, summed over threads.
class WaitTotal {
 public:
  void add(const WaitTime& more) {
    const std::lock_guard lock(mutex_);
    total_.seconds += more.seconds;
    total_.processor_seconds += more.processor_seconds;
    total_.slept_seconds += more.slept_seconds;
    total_.waits += more.waits;
    total_.transfers += more.transfers;
    total_.most_queued_seconds = std::max(total_.most_queued_seconds, more.most_queued_seconds);
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
  void expect(double seconds) { ready_ = std::max(ready_, Clock::now()) + duration(seconds); }

  /// Calls `wait`, which returns when the queue is empty but for work of `left` seconds. Before it
  /// sleeps, it calls `flush`, which passes the queued work to the device. @return what `wait`
  /// does.
  template <class Flush, class Wait>
  auto operator()(const Flush& flush, const Wait& wait, double left = 0) {
    const auto begin = Clock::now();
    const double used_before = thread_seconds();
    const double slept = sleep(begin, left, flush);
    const auto awake = Clock::now();
    const double used_awake = thread_seconds();
    const auto result = wait();
    const auto end = Clock::now();
    ready_ = end + duration(left);
    const double used = thread_seconds();
    const double waited = seconds(end - awake);
    if (waited > kTellingWait) spins_ = used - used_awake > kBusy * waited;
    total_->add({.seconds = seconds(end - begin),
                 .processor_seconds = used - used_before,
                 .slept_seconds = slept,
                 .waits = 1});
    return result;
  }

  /// Whether the last wait that was long enough to be measured kept the processor busy.
  bool spins() const { return spins_; }

 private:
  static constexpr double kPart = 0.75;          ///< of the expected time that is slept through
  static constexpr double kLeastSleep = 0.5e-3;  ///< s; a sleep may be late by a tenth of that
  static constexpr double kTellingWait = 1e-3;   ///< s
  static constexpr double kBusy = 0.25;          ///< of a core

  static double seconds(Clock::duration time) {
    return std::chrono::duration<double>(time).count();
  }

  static Clock::duration duration(double seconds) {
    return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  }

  static double thread_seconds() {
    std::timespec time{};
    ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
  }

  template <class Flush>
  double sleep(Clock::time_point begin, double left, const Flush& flush) {
    const double part = kPart * (seconds(ready_ - begin) - left);
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
  /// Whether a launch has been timed.
  bool is_known() const { return is_known_; }
  /// Seconds that a launch of this many units is expected to take at least, so that sleeps are not
  /// too long; 0 if unknown.
  double least(double units) const { return low_ * units; }
  /// Seconds that it may take, so that queues do not get too deep; 0 if unknown.
  double most(double units) const { return high_ * units; }
  /// The low estimate falls at once and rises slowly, the high one rises at once and falls slowly.
  void learn(double units, double seconds) {
    is_known_ = true;
    if (units <= 0 || seconds <= 0) return;
    const double rate = seconds / units;
    low_ = low_ == 0 ? rate : std::min(rate, 0.5 * (low_ + rate));
    high_ = std::max(rate, 0.5 * (high_ + rate));
  }

 private:
  bool is_known_ = false;
  double low_ = 0, high_ = 0;  ///< seconds per unit
};

}  // namespace qjulia::device
