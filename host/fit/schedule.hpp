#pragma once
/// What a fit does, stage by stage, as data.

#include <string>
#include <vector>

#include "qjulia/fit.hpp"

namespace qjulia {

/// A part of the fit in which stages repeat: each draws new samples, refreshes the preconditioner
/// and runs L-BFGS. Lengths are in map units.
struct Phase {
  std::string name;
  double until;        ///< share of the budget at which the phase ends
  int samples;         ///< drawn at each stage
  double band;         ///< b: samples with |d| < b aim at d, those farther at "beyond ±b"
  double band_weight;  ///< of a sample in the band; one on the surface or farther has 1
  int iterations;      ///< L-BFGS steps of a stage
  int relocated;       ///< factors moved to where the residual is, before each stage
};

struct Schedule {
  std::string name;
  int evaluations;  ///< of a whole fit, unless the caller sets another number
  double damping;   ///< λ of the preconditioner
  std::vector<Phase> phases;
};

/// @throws InputError for an unknown name, listing those there are.
const Schedule& find_schedule(const std::string& name);

}  // namespace qjulia
