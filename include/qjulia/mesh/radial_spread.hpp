#pragma once
/// How the detail that a word stands for follows from a shape.

#include <Eigen/Core>

#include "qjulia/base/detail_choice.hpp"
#include "qjulia/mesh/mesh.hpp"

namespace qjulia {

/// What the roughness of a shape's set depends on, besides δ.
struct RadialSpread {
  /// ∫ A (1 − A) d ln r, with A(r) the share of the sphere of radius r about the origin that is
  /// inside; in other words, half the mean difference of ln r between the points where two random
  /// rays from the origin leave the shape. 0 for a ball about the origin, 0.07 for a skull, 0.2 for
  /// a scorpion. A point with F_1 = ln r is taken to that sphere, in any direction, so that A is
  /// its chance to stay inside. The shell that is neither solid nor empty is therefore about this
  /// value times 1 / |∇F_1| deep.
  double of_log_radii = 0;
  double longest_side = 1;  ///< the box's, over its diagonal
};

/// @param mesh without hidden parts. @param origin inside, where the map takes 0; the mesh's units.
/// @throws InputError when the mesh is not valid or not closed about the origin.
RadialSpread radial_spread(const TriangleMesh& mesh, const Eigen::Vector3d& origin);

/// How `automatic` follows from the spread, so that sets have a roughness of about 1.2 on a grid of
/// 256 cells (docs/theory/detail.md). `cells` is the shell's depth in such cells for a spread of 1.
struct DetailRule {
  double cells, power;
};
constexpr DetailRule kFittedRule{0.48, 1.2}, kExactRule{0.35, 1};

/// δ for a shape: `automatic` is cells / 256 · longest_side / of_log_radii^power, at most 0.03.
double chosen_detail(const DetailChoice& detail, const RadialSpread& spread,
                     const DetailRule& rule);

}  // namespace qjulia
