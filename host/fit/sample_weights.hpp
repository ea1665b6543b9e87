#pragma once
/// Weights of samples that the caller of a fit gives by position.

#include <span>
#include <vector>

#include "fit/energy_names.hpp"
#include "qjulia/fit/fit.hpp"
#include "qjulia/map/map.hpp"

namespace qjulia::fitting {

/// The values of `weights` at these points, in the mesh's coordinates.
/// @throws OptionError naming `weights` unless it is a finite number of 0 or more for each.
std::vector<double> weights_at(const SampleWeights& weights,
                               std::span<const Eigen::Vector3d> points);

/// Multiplies the weights of the samples on the slice, and scales them so that their sum stays as
/// it was; with the loss tanh, the sum of either side.
/// @throws OptionError naming `weights`, where they are 0 for all of them too.
void weigh(Samples& samples, const SampleWeights& weights, const ShapeToMap& frame, Loss loss);

}  // namespace qjulia::fitting
