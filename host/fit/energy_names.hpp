#pragma once
/// Fits speak of samples, evaluators and curvature without the name of their room.

#include "energy/evaluator.hpp"

namespace qjulia::fitting {

using namespace energy;

}  // namespace qjulia::fitting
