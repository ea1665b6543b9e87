#pragma once
/// The modulus of a map R(q) = e^F(q) U(q): how far from the origin each image lies. F has several
/// kinds.
///
/// A kind is a struct here with the members that a map file and a device hold; its longer functions
/// are in host/map/NAME_modulus.cpp, its field on the device in kernels/NAME_modulus.clh. Functions
/// defined here take the dynamics as `auto`: they are declared later.

#include <Eigen/Core>
#include <cmath>
#include <memory>
#include <variant>

#include "qjulia/base/quaternion.hpp"
#include "qjulia/map/distance_grid.hpp"

namespace qjulia {

struct Dynamics;

/// A radius beyond which F > ln |q| for certain, map units.
struct OuterBound {
  double radius = 0;
  bool is_sharp = false;  ///< no smaller radius would do
};

/// F = S + Σ a_k ln |q − c_k| over the map's factors.
struct FactorsModulus {
  static constexpr const char* kName = "factors";
  static constexpr bool kTakesFactors = true;
  static constexpr int kFileVersion = 1;  ///< the first version of map files that can hold it

  bool operator==(const FactorsModulus&) const = default;

  /// Calls `visit(name, member)` for each member that map files hold.
  template <class Self, class Visit>
  static void members(Self& /*self*/, const Visit& /*visit*/) {}

  /// What F grows with, far out: F ≈ degree · ln |q|.
  static double degree(const Dynamics& map);
  /// Asked for maps whose degree is above 1.
  static OuterBound outer_bound(const Dynamics& map);
};

/// F = S + ln |q² + c|.
struct QuadraticModulus {
  static constexpr const char* kName = "quadratic";
  static constexpr bool kTakesFactors = false;
  static constexpr int kFileVersion = 1;

  Quaternion c;  ///< map coordinates

  bool operator==(const QuadraticModulus&) const = default;
  template <class Self, class Visit>
  static void members(Self& self, const Visit& visit) {
    visit("c", self.c);
  }
  static double degree(const Dynamics& /*map*/) { return 2; }
  /// The r of e^S (r² − |c|) = r.
  OuterBound outer_bound(const auto& map) const {
    const double scale = std::exp(map.log_scale);
    return {(1 + std::sqrt(1 + 4 * scale * scale * norm(c))) / (2 * scale), true};
  }
};

/// How far a point is from a shape of three dimensions in the fourth.
enum class FourthCoordinate {
  round,    ///< d₄ = √((d + r_in)² + W²) − r_in: about as round as the shape is thick
  ignored,  ///< d₄ = d: the set has no end along W, and is rougher
};

/// F = S + d₄(q) / δ, with d₄ from the signed distance d to a shape, which a grid holds. Beyond the
/// grid, d is that of the nearest point of it and the way there.
struct DistanceModulus {
  static constexpr const char* kName = "distance";
  static constexpr bool kTakesFactors = false;
  static constexpr int kFileVersion = 2;

  std::shared_ptr<const DistanceGrid> grid;          ///< none: no valid map
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< the grid's, map units
  double step = 0;                                   ///< of the grid, map units a cell
  double shell = 0;                                  ///< δ, map units
  double inradius = 0;                               ///< r_in, map units
  FourthCoordinate fourth = FourthCoordinate::round;

  bool operator==(const DistanceModulus& other) const;
  /// Its members are one object of a map file.
  template <class Self, class Visit>
  static void members(Self& self, const Visit& visit) {
    visit("distance", self);
  }
  /// @throws InputError naming what is wrong.
  void validate() const;
  double degree(const Dynamics& map) const;
  OuterBound outer_bound(const Dynamics& map) const;
};

using Modulus = std::variant<FactorsModulus, QuadraticModulus, DistanceModulus>;

}  // namespace qjulia
