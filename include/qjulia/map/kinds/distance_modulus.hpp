#pragma once
/// The modulus of a distance on a grid: host/map/kinds/distance_modulus.cpp,
/// kernels/distance_modulus.clh.

#include <Eigen/Core>
#include <array>
#include <memory>

#include "qjulia/base/word.hpp"
#include "qjulia/map/distance_grid.hpp"
#include "qjulia/map/kinds/kind.hpp"

namespace qjulia {

/// How far a point is from a shape of three dimensions in the fourth.
enum class FourthCoordinate {
  round,    ///< d₄ = √((d + r_in)² + W²) − r_in: about as round as the shape is thick
  ignored,  ///< d₄ = d: the set has no end along W, and is rougher
};

constexpr std::array<Word<FourthCoordinate>, 2> words(FourthCoordinate /*of*/) {
  return {{{FourthCoordinate::round, "round"}, {FourthCoordinate::ignored, "ignored"}}};
}

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
  /// Calls `visit(name, leaf)` for each member of that object. What has no name has several keys.
  template <class Self, class Visit>
  static void leaves(Self& self, const Visit& visit) {
    visit("", self.grid);
    visit("origin", self.origin);
    visit("step", self.step);
    visit("shell", self.shell);
    visit("inradius", self.inradius);
    visit("fourth", self.fourth);
  }
  static double cost(const Dynamics& /*map*/) { return 40; }  // measured
  static constexpr bool kHasCubeBounds = false;
  /// How far from the origin the inside reaches at least, map units.
  double reach() const { return inradius; }
  /// @throws InputError naming what is wrong.
  void validate() const;
  double degree(const Dynamics& map) const;
  OuterBound outer_bound(const Dynamics& map) const;
};

}  // namespace qjulia
