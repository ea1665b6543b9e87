#pragma once
/// How much a fit may still spend, and why it stopped.

#include <chrono>
#include <optional>

#include "fit/team.hpp"
#include "qjulia/fit.hpp"

namespace qjulia::fitting {

/// Evaluations, time and stop requests. Time and requests are rank 0's, as they were at the last
/// `update`, so that all ranks decide alike.
class Budget {
 public:
  using Clock = std::chrono::steady_clock;

  /// @param reserve seconds kept back from the time limit for what follows the last evaluation.
  Budget(const FitOptions& options, int schedule_evaluations, Clock::time_point start,
         double reserve, std::stop_token stop, Team& team);

  void count_evaluation() { ++evaluations_; }
  /// What an earlier process has spent on the same fit; the time limit is what this one may add.
  void carry(int evaluations, double seconds);
  /// Looks at the clock and for a stop request.
  void update();

  int most_evaluations() const { return most_evaluations_; }
  int evaluations() const { return evaluations_; }
  double seconds() const { return carried_seconds_ + seconds_; }
  /// Seconds until the time limit; infinite without one.
  double time_left() const { return time_limit_ - seconds(); }
  /// The share that is spent, 0 … 1: of the evaluations or of the time, whichever is more.
  double fraction() const;
  /// Estimate until the end; negative when unknown.
  double seconds_left() const;
  /// Why no further evaluation may be made, if so.
  std::optional<StopReason> spent() const;

 private:
  Clock::time_point start_;
  double time_limit_;
  int most_evaluations_;
  bool limited_by_caller_;  ///< by evaluations asked for, not by the schedule's own number
  std::stop_token stop_;
  Team& team_;
  int evaluations_ = 0;
  double carried_seconds_ = 0;
  double seconds_ = 0;  ///< since the start, at the last update
  bool stop_requested_ = false;
};

}  // namespace qjulia::fitting
