#pragma once
/// Balls inside which a map is a similarity instead, so that copies of its set stand there.
///
/// A. Schor and T. Kim, Into the Portal: Directable Fractal Self-Similarity (SIGGRAPH 2024).

#include <Eigen/Core>
#include <array>

#include "qjulia/base/rotation.hpp"
#include "qjulia/base/word.hpp"

namespace qjulia {

/// Which points of its ball a portal takes, by the side that four iterates of the map without
/// portals have them on.
enum class PortalMask {
  none,     ///< all: the copy stands in place of the shape
  outside,  ///< those outside: the copy is added to the shape
  inside,   ///< those inside: of the shape only what lies in the copy is left
};

constexpr std::array<Word<PortalMask>, 3> words(PortalMask /*of*/) {
  return {{{PortalMask::none, "none"},
           {PortalMask::outside, "outside"},
           {PortalMask::inside, "inside"}}};
}

/// The side of the points that a mask takes, as devices have it: 1 outside, -1 inside, 0 for all.
constexpr int side_of(PortalMask mask) {
  return mask == PortalMask::outside ? 1 : mask == PortalMask::inside ? -1 : 0;
}

/// Where |q − center| < radius, R(q) = destination + scale · rotation (x − center), with q = (x,
/// W), and W is scaled too. All in map coordinates, centre and destination with W = 0.
struct Portal {
  static constexpr double kLeastScale = 1e-3, kMostScale = 1e6;

  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  double radius = 0;
  double scale = 1;  ///< the copy is so many times as small as the set
  Rotation rotation;
  Eigen::Vector3d destination = Eigen::Vector3d::Zero();  ///< where the centre leads
  PortalMask mask = PortalMask::none;

  bool operator==(const Portal&) const = default;
};

/// The most portals of a map.
constexpr int kMostPortals = 64;

}  // namespace qjulia
