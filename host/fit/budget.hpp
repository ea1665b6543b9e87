#pragma once
/// How much a fit may still spend, and why it stopped.

#include <functional>
#include <optional>
#include <stop_token>

#include "qjulia/fit/fit.hpp"

namespace qjulia::fitting {

/// The largest number of triangles that a fit measures; a mesh with more is replaced by a coarser
/// one. Measuring takes 4 to 20 µs a triangle on two cores, so with a limit of a second or more it
/// takes at most a fifth of the limit.
/// @param time_limit of the fit, seconds; if infinite, there may be any number of triangles.
double most_triangles(double time_limit);
/// A time limit, in whole seconds, that suffices to read and measure so many triangles; 0 if any
/// limit does.
double least_limit(double triangles);

/// How long a fit has taken, and whether it is asked to stop.
struct Moment {
  double seconds = 0;
  bool stop_requested = false;
};

/// Returns the present moment.
using Clock = std::function<Moment()>;

/// A clock that starts now and reports when `stop` is requested.
Clock start_clock(std::stop_token stop);

/// Evaluations, time and stop requests: the latter two as they were at the last `update`.
class Budget {
 public:
  /// @param reserve seconds kept back from the time limit for what follows the last evaluation.
  Budget(const FitOptions& options, int schedule_evaluations, double reserve, Clock clock);

  void count_evaluation() { ++evaluations_; }
  /// What an earlier process has spent on the same fit; the time limit is what this one may add.
  void carry(int evaluations, double seconds);
  /// Looks at the clock.
  void update();

  int most_evaluations() const { return most_evaluations_; }
  int evaluations() const { return evaluations_; }
  double seconds() const { return carried_seconds_ + now_.seconds; }
  /// Seconds until the time limit; infinite without one.
  double time_left() const { return time_limit_ - seconds(); }
  /// The share that is spent, 0 … 1: of the evaluations or of the time, whichever is more.
  double fraction() const;
  /// Estimate until the end; negative when unknown.
  double seconds_left() const;
  /// Why no further evaluation may be made, if so.
  std::optional<StopReason> spent() const;

 private:
  Clock clock_;
  double time_limit_;
  int most_evaluations_;
  bool limited_by_caller_;  ///< by evaluations asked for, not by the schedule's own number
  int evaluations_ = 0;
  double carried_seconds_ = 0;
  Moment now_;  ///< the moment of the last update
};

}  // namespace qjulia::fitting
