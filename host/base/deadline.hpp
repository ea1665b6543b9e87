#pragma once
/// Stop requests by the clock.

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <stop_token>
#include <thread>

namespace qjulia::base {

/// Requests its token to stop when another token is requested to, or when time is up, as long as it
/// lives.
class Deadline {
 public:
  /// @param seconds from now on; if infinite, time is never up.
  Deadline(const std::stop_token& stop, double seconds)
      : forward_(stop, [this] { stop_.request_stop(); }) {
    constexpr double kNever = 1e9;
    if (seconds < kNever)
      timer_ = std::jthread([this, seconds](const auto& end) { wait(end, seconds); });
  }
  Deadline(const Deadline&) = delete;
  Deadline& operator=(const Deadline&) = delete;

  std::stop_token token() const { return stop_.get_token(); }

 private:
  void wait(const std::stop_token& end, double seconds) {
    std::mutex mutex;
    std::condition_variable_any ended;
    std::unique_lock lock(mutex);
    ended.wait_for(lock, end, std::chrono::duration<double>(seconds), [] { return false; });
    if (!end.stop_requested()) stop_.request_stop();
  }

  std::stop_source stop_;
  std::stop_callback<std::function<void()>> forward_;
  std::jthread timer_;
};

}  // namespace qjulia::base
