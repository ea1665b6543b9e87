#pragma once
/// The map R(q) = e^F(q) U(q), a modulus and a versor, and what is known of the shape it fits.
///
/// A fitted map is R(q) = e^S · p · Π_k (q − c_k)^{a_k}: both its modulus and its versor are of
/// factors, and take them from one list. A map with other kinds is iterated and looked at alike.

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "qjulia/base/box.hpp"
#include "qjulia/base/quaternion.hpp"
#include "qjulia/base/shape_to_map.hpp"
#include "qjulia/base/up_axis.hpp"
#include "qjulia/map/modulus.hpp"
#include "qjulia/map/paint.hpp"
#include "qjulia/map/portal.hpp"
#include "qjulia/map/provenance.hpp"
#include "qjulia/map/versor.hpp"

namespace qjulia {

/// One factor (q − center)^exponent: a root where exponent > 0, a pole where it is negative.
struct Factor {
  Quaternion center;  ///< map coordinates
  double exponent = 0;
};

/// The largest Layers::steepness.
constexpr double kMostSteepness = 100;

/// What is iterated: R(q) = e^F(q) U(q) and the level that its orbits are measured against.
struct Dynamics {
  double slice = 0;              ///< W of the points that 3-D coordinates stand for
  double log_scale = 0;          ///< S, added to every kind of F
  double surface_level = 0;      ///< L: a point is inside at n when F_n < L
  Quaternion phase{1, 0, 0, 0};  ///< p, in front of every kind of U
  Modulus modulus;
  Versor versor;
  /// Product order, left to right; what a modulus and a versor of factors are made of. Empty where
  /// neither is.
  std::vector<Factor> factors;

  /// What F grows with, far out: F ≈ degree · ln |q|. Σ a_k of factors, 2 of a quadratic map; the
  /// set is bounded when it exceeds 1.
  double degree() const;
  /// "rational" where modulus and versor are of factors, "quadratic" where both are quadratic, else
  /// their names with a slash between.
  std::string kind() const;
  /// Whether the modulus and the versor are of factors, as `fit` makes them.
  bool is_rational() const;
};

/// What lies over the dynamics and changes how the set looks.
struct Layers {
  double steepness = 1;  ///< k: where F > L, it is L + k (F − L) instead; 1 … kMostSteepness
  std::optional<Paint> paint;  ///< which share of the detail places have; none: all of it
  /// Balls in which the map is another; they have no point in common, and none holds the origin.
  std::vector<Portal> portals;
};

/// Where the shape lies and how large it is.
struct Frame {
  ShapeToMap shape_to_map;
  std::optional<Box> box;          ///< the shape's, shape units
  std::optional<double> inradius;  ///< the shape's, shape units
  std::optional<UpAxis> up;        ///< how the shape stands
  std::optional<double> detail;    ///< δ as a fraction of `own_diagonal`
  /// The diagonal of the shape's box before the shape was turned, shape units; empty if it was not
  /// turned.
  std::optional<double> diagonal;

  /// The diagonal of the shape's own box, which turning does not change, shape units.
  std::optional<double> own_diagonal() const {
    return diagonal || !box ? diagonal : std::optional(box->diagonal());
  }
};

/// A map as the map file holds it (docs/reference/map-format.md).
struct Map {
  Dynamics dynamics;
  Layers layers;
  Frame frame;
  Provenance provenance;

  /// @throws InputError naming what is wrong: no factors where they are needed, or some where they
  ///   are not; a number that is not finite or beyond ±1e15, in map coordinates ±1e9 (single
  ///   precision squares the one and takes fourth powers of the other), a phase that is not a unit
  ///   quaternion, a scale that is not positive, a steepness out of range, different numbers of one
  ///   name in the modulus and the versor, portals that overlap or hold the origin, a paint that is
  ///   not whole.
  void validate() const;
};

/// The longest side of the shape as it was fitted, shape units. A turned map's box may be longer,
/// because it holds the turned box.
/// @throws InputError where the map does not know its shape's box.
double longest_side(const Map& map);
/// The same map with the shape in other units: its longest side is `length` of them.
/// @throws InputError where the map does not know its shape's box.
Map with_longest_side(Map map, double length);
/// The same map without its portals, or with the same detail everywhere.
Map without_portals(Map map);
Map without_paint(Map map);

/// R(q) = q² + c.
Map quadratic_map(const Quaternion& c);

}  // namespace qjulia
