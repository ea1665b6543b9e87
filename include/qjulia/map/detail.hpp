#pragma once
/// The shell around the shape in which the fractal lives, and how thick it is: `detail`.

#include <Eigen/Core>
#include <span>

#include "qjulia/device/device.hpp"
#include "qjulia/map/field.hpp"
#include "qjulia/map/map.hpp"

namespace qjulia {

/// The range of details that can be asked for, fractions of the box's diagonal. For a very thin
/// shape a word (`DetailWord`) may stand for less.
constexpr double kLeastDetail = 0.0001, kMostDetail = 0.1;

/// F_1 − L multiplied by t everywhere: a_k ← t a_k (of a distance modulus, δ ← δ / t),
/// S ← t (S − L) + L. The surface F_1 = L stays where it is and the shell gets t times thinner;
/// `detail` is divided by t where it is known. @throws InputError unless t is positive.
Map steepened(const Map& map, double t);

/// The same shape with another shell: `steepened` by (the map's own detail) / `detail`.
/// @throws InputError when the map does not say its own detail, `detail` is not positive, or Σ a_k
///   would not exceed 1 (the set would not be bounded); the message says which details are
///   possible.
Map with_detail(const Map& map, double detail);

/// δ = 1 / mean ‖∇F_1‖, the gradient in the three dimensions of the slice; map units.
/// @param surface area-uniform points of the shape's surface, map coordinates.
double shell_thickness(const Field& field, std::span<const Eigen::Vector3d> surface, double slice);

/// The median of F_1 over `surface`: the level at which the map's surface is the shape's best.
double median_level(const Field& field, std::span<const Eigen::Vector3d> surface, double slice);

/// The map with its `detail` as measured on `surface`, for a map whose slope is whatever the fit
/// left (say F_1 ≈ signed distance).
/// @param surface area-uniform points of the shape's surface, map coordinates.
/// @throws InputError when the map has no `box`.
Map with_measured_detail(const Device& device, Map map, std::span<const Eigen::Vector3d> surface);

}  // namespace qjulia
