#pragma once
/// Meshes whose vertices say how much of the detail their places have.

#include <Eigen/Core>
#include <filesystem>
#include <stop_token>
#include <string>
#include <vector>

#include "qjulia/mesh/mesh.hpp"

namespace qjulia {

/// Triangles with a share of the detail at each of their vertices, shape units.
struct PaintedMesh {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Triangle> triangles;
  std::vector<float> shares;  ///< 0 … 1
};

/// Reads a mesh with what it says at its vertices: the number of that name, 0 … 1 or bytes (.ply);
/// or where `property` is empty, how bright its colors are: "red green blue" (.ply), or three
/// numbers after the coordinates (.obj).
/// @throws InputError as `read_mesh`, where there is no such number, and where one is not 0 … 1.
PaintedMesh read_painted_mesh(const std::filesystem::path& path, const std::string& property = {},
                              std::stop_token stop = {});

}  // namespace qjulia
