#pragma once
/// What a fit does, level by level, as data.

#include <string>
#include <vector>

#include "fit/energy_names.hpp"

namespace qjulia {
struct FitOptions;
}

namespace qjulia::fitting {

/// Where a level's samples lie.
enum class Points {
  surface,  ///< drawn anew at each stage, on the surface, near it, and a few farther off
  grid      ///< the centres of a regular grid's cells, the same at each stage
};

/// What a level moves, from coarse to fine. An exponents-only fit leaves centres out of all.
enum class Space {
  scalars,    ///< the log scale, one factor on all roots' exponents and one on all poles'
  clusters,   ///< neighbouring factors change together: exponents by one ratio, centres by one
              ///< vector
  exponents,  ///< the log scale and every exponent
  all         ///< the log scale, every exponent and every centre
};

/// A part of the fit in which stages repeat: each takes samples, refreshes the preconditioner and
/// runs L-BFGS. Lengths are in map units.
struct Level {
  std::string name;
  double until = 1;  ///< share of the budget at which the level ends; on a grid, or converged
  Points points = Points::surface;
  int iterations = 1;   ///< n; above 1 the map has the wanted detail, below it is in distance units
  int samples = 20000;  ///< a stage's number of samples, or of cells along a grid's side
  Loss loss = Loss::distance;
  double alpha = 10;       ///< sharpness of the tanh loss
  double band = 0.04;      ///< b: samples with |d| < b aim at d, those farther at "beyond ±b"
  double band_weight = 1;  ///< a sample's in the band; on the surface and farther out it is 1
  double off_slice_weight =
      0;                ///< a sample's off the slice; 0: there are none. In a file 0.5 if not given
  double reweight = 0;  ///< r: weights times 1 + r e / mean e, e the error at the stage's start
  Space space = Space::all;
  int clusters = 40;  ///< roots and poles together
  int steps = 60;     ///< L-BFGS steps of a stage
  int relocated = 0;  ///< factors moved to where the residual is, before each stage
};

/// How many factors a fit has when its caller does not say.
struct AutomaticFactors {
  int factors = 331;    ///< without a time limit
  int evaluations = 0;  ///< such a fit's; 0: the schedule's
  int stages = 0;       ///< that a time limit must leave room for; 0: it changes nothing
};

struct Schedule {
  int evaluations = 0;    ///< a whole fit's, unless the caller sets another number
  double damping = 1e-3;  ///< λ of the preconditioner
  std::vector<Level> levels;
  AutomaticFactors automatic{};
};

/// A built-in schedule by its name, or that of a file whose name ends in .toml.
/// @throws InputError for an unknown name, listing those there are, or naming file, line and key.
Schedule find_schedule(const std::string& name);
/// The schedule that options ask for. @throws InputError likewise
Schedule schedule_of(const FitOptions& options);
/// Its text. @throws InputError where there is none of that name.
std::string text_of_schedule(const FitOptions& options);

/// `schedule` in the first three fifths of the budget, then stages that climb −Σ w s tanh(F_2 − L)
/// at the wanted detail δ, over samples within a shell's thickness of the surface.
Schedule with_polish(Schedule schedule, double detail);

}  // namespace qjulia::fitting
