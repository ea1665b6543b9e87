#pragma once
/// A triangle as a row of numbers (layout/bvh.h), and its point nearest to another.

#include <Eigen/Geometry>
#include <algorithm>
#include <array>

#include "layout/bvh.h"

namespace qjulia::shape {

inline Eigen::Vector3d vector_at(const double* reals) { return {reals[0], reals[1], reals[2]}; }

/// Writes QJ_TRIANGLE_REALS numbers.
inline void flatten(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                    double* reals) {
  const Eigen::Vector3d ab = b - a;
  const Eigen::Vector3d ac = c - a;
  const auto inverse_square = [](const Eigen::Vector3d& edge) {
    const double square = edge.squaredNorm();
    return square > 0 ? 1 / square : 0;
  };
  Eigen::Map<Eigen::Vector3d>(reals + QJ_TRIANGLE_A) = a;
  Eigen::Map<Eigen::Vector3d>(reals + QJ_TRIANGLE_AB) = ab;
  Eigen::Map<Eigen::Vector3d>(reals + QJ_TRIANGLE_AC) = ac;
  Eigen::Map<Eigen::Vector3d>(reals + QJ_TRIANGLE_NORMAL) = ab.cross(ac).normalized();
  reals[QJ_TRIANGLE_AB2] = inverse_square(ab);
  reals[QJ_TRIANGLE_AC2] = inverse_square(ac);
  reals[QJ_TRIANGLE_BC2] = inverse_square(ac - ab);
}

/// The point nearest to v on the segment from the origin to `edge`, where `inverse` = 1 / |edge|².
inline Eigen::Vector3d nearest_on_segment(const Eigen::Vector3d& v, const Eigen::Vector3d& edge,
                                          double inverse) {
  return std::clamp(v.dot(edge) * inverse, 0.0, 1.0) * edge;
}

inline Eigen::Vector3d nearest_on_triangle(const Eigen::Vector3d& p, const double* triangle) {
  const Eigen::Vector3d a = vector_at(triangle + QJ_TRIANGLE_A);
  const Eigen::Vector3d ab = vector_at(triangle + QJ_TRIANGLE_AB);
  const Eigen::Vector3d ac = vector_at(triangle + QJ_TRIANGLE_AC);
  const Eigen::Vector3d normal = vector_at(triangle + QJ_TRIANGLE_NORMAL);
  const Eigen::Vector3d v = p - a;
  const Eigen::Vector3d bc = ac - ab;
  // In the plane, normal × edge points to the inner side of each edge.
  if (v.dot(normal.cross(ab)) > 0 && (v - ab).dot(normal.cross(bc)) > 0 &&
      v.dot(ac.cross(normal)) > 0) {
    return p - v.dot(normal) * normal;
  }
  const std::array<Eigen::Vector3d, 3> candidates{
      nearest_on_segment(v, ab, triangle[QJ_TRIANGLE_AB2]),
      nearest_on_segment(v, ac, triangle[QJ_TRIANGLE_AC2]),
      ab + nearest_on_segment(v - ab, bc, triangle[QJ_TRIANGLE_BC2])};
  return a + *std::ranges::min_element(
                 candidates, {}, [&](const Eigen::Vector3d& x) { return (v - x).squaredNorm(); });
}

}  // namespace qjulia::shape
