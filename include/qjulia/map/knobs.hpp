#pragma once
/// What can be turned on a fitted map to make another shape or another texture of it.

#include <Eigen/Core>
#include <cstdint>
#include <optional>

#include "qjulia/base/rotation.hpp"
#include "qjulia/device/device.hpp"
#include "qjulia/map/map.hpp"

namespace qjulia {

/// Changes to a map, applied in the order they stand in. An empty one leaves the map as it is.
struct MapKnobs {
  /// δ as a fraction of the box's diagonal: a thicker shell is a wilder fractal.
  std::optional<double> detail;
  /// Order of the factors, shuffled by this seed: other grooves, the same potential.
  std::optional<std::uint64_t> order_seed;
  /// p, normalised here: other grooves, the same potential.
  std::optional<Quaternion> phase;
  /// The slice's W, map units: away from 0 thin parts vanish first.
  std::optional<double> slice;
  /// Turns the factors about the origin of iteration, and the shape with them. Only turns about x,
  /// the real axis, turn the grooves too.
  std::optional<Rotation> rotate;
  /// Moves the origin that iteration turns about along z, in inradii: grooves deepen, near 1 the
  /// set is a hollow crust, past 1.1 dust.
  std::optional<double> drift;
  /// Moves that origin by a vector, in the shape's units.
  std::optional<Eigen::Vector3d> translate;
  /// S ← S − ln s: above 1 the set grows, below it shrinks.
  std::optional<double> scale;
  /// How many times as steep F is outside the shape, 1 … kMostSteepness: what stands off the shape
  /// gets so much shorter, and few tufts come loose.
  std::optional<double> steepness;

  /// @throws InputError naming the option: a number that is not finite, a phase or an axis of zero,
  ///   a scale that is not positive.
  void validate() const;
};

/// The map with the knobs turned. Where the origin moves, the map is calibrated again.
/// @throws InputError when an option needs what the map does not say: `detail` its own detail,
///   `drift` the inradius.
Map with_knobs(const Device& device, const Map& map, const MapKnobs& knobs);

}  // namespace qjulia
