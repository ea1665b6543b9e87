#pragma once
/// Points drawn on a mesh.

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "qjulia/mesh/mesh.hpp"

namespace qjulia::shape {

/// A point on a triangle.
struct TrianglePoint {
  std::size_t triangle;     ///< its number in the mesh
  Eigen::Vector3d weights;  ///< barycentric: the share of each corner

  Eigen::Vector3d position(const TriangleMesh& mesh) const {
    const auto& [a, b, c] = mesh.triangles[triangle];
    return weights[0] * mesh.vertices[a] + weights[1] * mesh.vertices[b] +
           weights[2] * mesh.vertices[c];
  }
};

/// `count` points uniform by area; the same for the same seed, with any standard library.
/// @throws InputError when the mesh has no area.
std::vector<TrianglePoint> sample_triangles(const TriangleMesh& mesh, std::size_t count,
                                            std::uint64_t seed);

}  // namespace qjulia::shape
