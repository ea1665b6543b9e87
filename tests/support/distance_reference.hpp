#pragma once
/// Distance to a mesh and winding number by going over all triangles, in double precision.

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "qjulia/mesh/mesh.hpp"

namespace qjulia::reference {

/// Closest point of a triangle by the region of barycentric space the point projects to
/// (Ericson, Real-Time Collision Detection, 2005, section 5.1.5).
inline Eigen::Vector3d closest_point(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                     const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const Eigen::Vector3d ab = b - a;
  const Eigen::Vector3d ac = c - a;
  const double d1 = ab.dot(p - a);
  const double d2 = ac.dot(p - a);
  if (d1 <= 0 && d2 <= 0) return a;
  const double d3 = ab.dot(p - b);
  const double d4 = ac.dot(p - b);
  if (d3 >= 0 && d4 <= d3) return b;
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + d1 / (d1 - d3) * ab;
  const double d5 = ab.dot(p - c);
  const double d6 = ac.dot(p - c);
  if (d6 >= 0 && d5 <= d6) return c;
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + d2 / (d2 - d6) * ac;
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    return b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b);
  }
  return a + (vb * ab + vc * ac) / (va + vb + vc);
}

inline double distance(const TriangleMesh& mesh, const Eigen::Vector3d& p) {
  double best = std::numeric_limits<double>::infinity();
  const auto& x = mesh.vertices;
  for (const auto& [a, b, c] : mesh.triangles) {
    best = std::min(best, (closest_point(p, x[a], x[b], x[c]) - p).norm());
  }
  return best;
}

/// Sum of solid angles over 4 pi (van Oosterom and Strackee 1983).
inline double winding_number(const TriangleMesh& mesh, const Eigen::Vector3d& p) {
  double sum = 0;
  for (const auto& triangle : mesh.triangles) {
    const Eigen::Vector3d a = mesh.vertices[triangle[0]] - p;
    const Eigen::Vector3d b = mesh.vertices[triangle[1]] - p;
    const Eigen::Vector3d c = mesh.vertices[triangle[2]] - p;
    const double below = a.norm() * b.norm() * c.norm() + a.dot(b) * c.norm() +
                         b.dot(c) * a.norm() + c.dot(a) * b.norm();
    sum += 2 * std::atan2(a.dot(b.cross(c)), below);
  }
  return sum / (4 * std::numbers::pi);
}

}  // namespace qjulia::reference
