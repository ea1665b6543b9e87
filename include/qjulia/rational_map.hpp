#pragma once
/// The rational map R(q) = e^S · p · Π_k (q − c_k)^{a_k} and what is known of the shape it fits;
/// also the quadratic map R(q) = e^S · p · (q² + c), which is iterated and looked at in the same
/// way.

#include <Eigen/Core>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "qjulia/quaternion.hpp"

namespace qjulia {

/// One factor (q − center)^exponent: a root where exponent > 0, a pole where it is negative.
struct Factor {
  Quaternion center;  ///< map coordinates
  double exponent = 0;
};

/// x_map = scale · x_shape + translation.
struct ShapeToMap {
  double scale = 1;
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Eigen::Vector3d to_map(const Eigen::Vector3d& x) const { return scale * x + translation; }
  Eigen::Vector3d to_shape(const Eigen::Vector3d& x) const { return (x - translation) / scale; }
};

/// An axis-aligned box.
struct Box {
  Eigen::Vector3d low = Eigen::Vector3d::Zero();
  Eigen::Vector3d high = Eigen::Vector3d::Zero();

  Eigen::Vector3d size() const { return high - low; }
  Eigen::Vector3d center() const { return 0.5 * (low + high); }
  double diagonal() const { return size().norm(); }
};

/// A map as the map file holds it (docs/map-format.md).
struct RationalMap {
  double slice = 0;          ///< W of the points that 3-D coordinates stand for
  double log_scale = 0;      ///< S
  double surface_level = 0;  ///< L: a point is inside at n when F_n < L
  Quaternion phase{1, 0, 0, 0};
  std::vector<Factor> factors;          ///< product order, left to right; none in a quadratic map
  std::optional<Quaternion> quadratic;  ///< c: the map is quadratic
  ShapeToMap shape_to_map;
  std::optional<double> detail;    ///< δ as a fraction of the box's diagonal
  std::optional<double> inradius;  ///< of the shape, shape units
  std::optional<Box> box;          ///< of the shape, shape units
  nlohmann::json provenance = nlohmann::json::object();

  /// Σ a_k, or 2 of a quadratic map; the set is bounded when it exceeds 1.
  double degree() const;
  /// @throws InputError naming what is wrong: no factors, factors and c, a number that is not
  ///   finite or beyond ±1e15, in map coordinates ±1e9 (single precision squares the one and takes
  ///   fourth powers of the other), a phase that is not a unit quaternion, a scale that is not
  ///   positive.
  void validate() const;
};

}  // namespace qjulia
