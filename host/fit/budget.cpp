#include "fit/budget.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace qjulia::fitting {
namespace {

constexpr double kFewestTriangles = 10'000;
constexpr double kTrianglesPerSecond = 10'000;

}  // namespace

double most_triangles(double time_limit) {
  return std::max(kFewestTriangles, std::floor(kTrianglesPerSecond * time_limit));
}

double least_limit(double triangles) {
  constexpr double kWithReading = 1.05;
  if (triangles <= kFewestTriangles) return 0;
  return std::ceil(kWithReading * triangles / kTrianglesPerSecond);
}

Clock start_clock(std::stop_token stop) {
  using Steady = std::chrono::steady_clock;
  return [start = Steady::now(), stop = std::move(stop)] {
    return Moment{std::chrono::duration<double>(Steady::now() - start).count(),
                  stop.stop_requested()};
  };
}

Budget::Budget(const FitOptions& options, int schedule_evaluations, double reserve, Clock clock)
    : clock_(std::move(clock)),
      time_limit_(options.most_seconds() - reserve),
      most_evaluations_(options.max_evaluations.value_or(schedule_evaluations)),
      limited_by_caller_(options.max_evaluations.has_value()) {
  update();
}

void Budget::update() { now_ = clock_(); }

void Budget::carry(int evaluations, double seconds) {
  evaluations_ = evaluations;
  carried_seconds_ = seconds;
  time_limit_ += seconds;  // the limit is that of this process
}

double Budget::fraction() const {
  const double by_count = static_cast<double>(evaluations_) / most_evaluations_;
  const double by_time = time_limit_ > 0 ? seconds() / time_limit_ : 1;
  return std::clamp(std::max(by_count, by_time), 0.0, 1.0);
}

double Budget::seconds_left() const {
  const double done = fraction();
  return done > 0 ? seconds() * (1 - done) / done : -1;
}

std::optional<StopReason> Budget::spent() const {
  if (now_.stop_requested) return StopReason::interrupted;
  if (evaluations_ >= most_evaluations_) {
    return limited_by_caller_ ? StopReason::evaluations : StopReason::schedule_done;
  }
  if (seconds() >= time_limit_) return StopReason::time_limit;
  return std::nullopt;
}

}  // namespace qjulia::fitting
