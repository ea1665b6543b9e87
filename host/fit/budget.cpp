#include "fit/budget.hpp"

#include <algorithm>

namespace qjulia::fitting {

Budget::Budget(const FitOptions& options, int schedule_evaluations, Clock::time_point start,
               double reserve, std::stop_token stop, Team& team)
    : start_(start),
      time_limit_(team.broadcast({options.time_limit - reserve}).front()),
      most_evaluations_(options.max_evaluations > 0 ? options.max_evaluations
                                                    : schedule_evaluations),
      limited_by_caller_(options.max_evaluations > 0),
      stop_(std::move(stop)),
      team_(team) {
  update();
}

void Budget::update() {
  const double seconds = std::chrono::duration<double>(Clock::now() - start_).count();
  const auto now = team_.broadcast({seconds, stop_.stop_requested() ? 1.0 : 0.0});
  seconds_ = now[0];
  stop_requested_ = now[1] != 0;
}

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
  if (stop_requested_) return StopReason::interrupted;
  if (evaluations_ >= most_evaluations_) {
    return limited_by_caller_ ? StopReason::evaluations : StopReason::schedule_done;
  }
  if (seconds() >= time_limit_) return StopReason::time_limit;
  return std::nullopt;
}

}  // namespace qjulia::fitting
