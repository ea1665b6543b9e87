#pragma once
/// Stop requests by the clock.

#include <chrono>
#include <condition_variable>
#include <functional>
#include <limits>
#include <mutex>
#include <optional>
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
    if (seconds >= kNever) return;
    at_ = Clock::now() + std::chrono::duration_cast<Clock::duration>(Seconds(seconds));
    timer_ = std::jthread([this](const std::stop_token& end) { wait(end); });
  }
  Deadline(const Deadline&) = delete;
  Deadline& operator=(const Deadline&) = delete;

  std::stop_token token() const { return stop_.get_token(); }

  /// Seconds until time is up; negative afterwards.
  double left() const {
    return at_ ? Seconds(*at_ - Clock::now()).count() : std::numeric_limits<double>::infinity();
  }

 private:
  using Clock = std::chrono::steady_clock;
  using Seconds = std::chrono::duration<double>;

  void wait(const std::stop_token& end) {
    std::mutex mutex;
    std::condition_variable_any ended;
    std::unique_lock lock(mutex);
    ended.wait_until(lock, end, *at_, [] { return false; });
    if (!end.stop_requested()) stop_.request_stop();
  }

  std::optional<Clock::time_point> at_;
  std::stop_source stop_;
  std::stop_callback<std::function<void()>> forward_;
  std::jthread timer_;
};

}  // namespace qjulia::base
