#pragma once
/// Pictures that lie on a mesh, and files that hold both.

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "qjulia/mesh/mesh.hpp"

namespace qjulia {

struct MeshTexture {
  /// Three for each triangle, one after the other: where its corners lie in the pictures, to the
  /// right and down, 0 … 1. Neighbours share none.
  std::vector<Eigen::Vector2f> places;
  std::string color;   ///< a .png, sRGB; empty: the mesh has one colour
  std::string normal;  ///< a .png of normals in tangent space, as glTF has them
  /// @throws InputError unless there are three places for each triangle, from 0 to 1, and normals
  void validate(const TriangleMesh& mesh) const;
};

/// Writes a .glb with the pictures in it. The mesh's normals are written, its colours are not.
/// @throws as `write_mesh`; InputError for another extension or a mesh without normals
void write_textured_mesh(const TriangleMesh& mesh, const MeshTexture& texture,
                         const std::filesystem::path& path, const MeshFileOptions& options = {});

}  // namespace qjulia
