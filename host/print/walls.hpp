#pragma once
/// How thick a mesh is at points of its surface.

#include <Eigen/Core>
#include <cstdint>
#include <stop_token>
#include <vector>

#include "qjulia/mesh/mesh.hpp"

namespace qjulia::surface {

/// A point of the surface, and the diameter of the largest ball inside that touches it there; both
/// in the mesh's units.
struct WallSample {
  Eigen::Vector3d position;
  double thickness;
};

/// The thickness of walls at `count` points, uniform by area; the same for the same seed.
/// `walls.cpp` says how a ball touches flat triangles.
/// @param mesh oriented outward. @param stop ends the work: Interrupted. @throws InputError when
/// the mesh has no area.
std::vector<WallSample> sample_walls(const TriangleMesh& mesh, std::size_t count,
                                     std::uint64_t seed, const std::stop_token& stop = {});

}  // namespace qjulia::surface
