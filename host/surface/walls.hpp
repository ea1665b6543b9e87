#pragma once
/// How thick a mesh is at points of its surface.

#include <Eigen/Core>
#include <cstdint>
#include <stop_token>
#include <vector>

#include "qjulia/mesh.hpp"

namespace qjulia::surface {

/// A point of the surface, and the diameter of the largest ball inside that touches it there.
struct WallSample {
  Eigen::Vector3d position;
  double thickness;
};

/// Walls at `count` points, uniform by area; the same for the same seed. `walls.cpp` says what a
/// ball on flat triangles is.
/// @param mesh outward. @param stop ends the work: Interrupted. @throws InputError when the mesh
/// has no area.
std::vector<WallSample> sample_walls(const TriangleMesh& mesh, std::size_t count,
                                     std::uint64_t seed, const std::stop_token& stop = {});

}  // namespace qjulia::surface
