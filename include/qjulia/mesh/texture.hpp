#pragma once
/// Pictures that lie on a mesh, and files that hold both.

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "qjulia/mesh/mesh.hpp"

namespace qjulia {

/// Pictures for the triangles of a mesh, 8-bit RGB.
struct MeshTexture {
  /// Texture coordinates of the corners, three for each triangle in the mesh's order: fractions of
  /// the picture's width, to the right, and of its height, down. `bake_texture` shares none between
  /// triangles.
  std::vector<Eigen::Vector2f> places;
  /// Tangents of length 1 at the same corners, and the sign of bitangents, 1 or -1, as glTF has
  /// them; or none.
  std::vector<Eigen::Vector4f> tangents{};
  std::string color;  ///< a .png, sRGB; empty: the mesh has one colour
  /// A .png of normals in tangent space: red to the right in the picture, green up, blue outward;
  /// bytes 0 … 255 stand for -1 … 1.
  std::string normal;
  /// @throws InputError for an invalid mesh or one without normals; for places that are not three
  ///   for each triangle, from 0 to 1; for tangents that are not as many; for pictures that are no
  ///   .png, or no picture of normals
  void validate(const TriangleMesh& mesh) const;
};

/// Whether `write_textured_mesh` writes files of this name.
bool holds_textures(const std::filesystem::path& path);

/// Writes a .glb with the pictures in it. Each triangle has three vertices of its own. The mesh's
/// normals are written, its colours are not.
/// @throws as `write_mesh` and `MeshTexture::validate`; InputError for another extension
void write_textured_mesh(const TriangleMesh& mesh, const MeshTexture& texture,
                         const std::filesystem::path& path, const MeshFileOptions& options = {});

}  // namespace qjulia
