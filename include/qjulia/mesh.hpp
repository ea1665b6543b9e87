#pragma once
/// Triangle meshes and their files.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "qjulia/rational_map.hpp"

namespace qjulia {

using Triangle = std::array<std::uint32_t, 3>;

struct TriangleMesh {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Triangle> triangles;  ///< counter-clockwise from outside
  /// Of vertices, outward, of length 1; or none. Written to files that hold them, not read.
  std::vector<Eigen::Vector3f> normals{};

  Box box() const;
};

/// What a mesh is like as a surface.
struct MeshReport {
  std::size_t vertices = 0;
  std::size_t triangles = 0;
  std::size_t components = 0;
  std::size_t open_edges = 0;          ///< edges with one triangle
  std::size_t non_manifold_edges = 0;  ///< edges with more than two triangles, or badly oriented
  std::size_t welded_vertices = 0;     ///< duplicates merged while reading
  std::size_t dropped_triangles = 0;   ///< without area, removed while reading
  bool is_inside_out = false;          ///< its signed volume is negative
  double rounding = 0;  ///< of coordinates in single precision, as mesh files are read and written,
                        ///< over the longest side
  bool closed() const { return open_edges == 0 && non_manifold_edges == 0; }
  /// One sentence a line on what a user should know; empty for a clean mesh.
  std::vector<std::string> warnings() const;
};

/// Reads .obj, .off, .ply or .stl by its extension, through OpenMesh and so with coordinates in
/// single precision; polygons are cut into triangles, equal vertices welded, and triangles without
/// area and vertices without triangles left out. Nothing else is lost: open, non-manifold and
/// inside-out meshes and triangle soups come as they are.
/// @throws InputError naming the file: missing, empty, of another type, truncated, an index out of
///   range, a coordinate that is not finite, no triangle with area.
TriangleMesh read_mesh(const std::filesystem::path& path, MeshReport* report = nullptr);

/// Writes by extension (.ply and .stl binary, .obj, .off), coordinates in single precision, under a
/// temporary name that is renamed. Also .glb, turned so that Z points up in viewers.
/// @param note a line of text, ASCII, that .obj holds as a comment and .glb under asset.extras;
/// .stl
///   and .off have no room for it.
/// @throws OutputError, or InputError for another extension.
void write_mesh(const TriangleMesh& mesh, const std::filesystem::path& path,
                const std::string& note = {});

MeshReport inspect(const TriangleMesh& mesh);

/// Volume enclosed by a closed mesh, negative when it is inside out (divergence theorem). For an
/// open one, the volume of the cones from its triangles to the centroid of its area.
double signed_volume(const TriangleMesh& mesh);

/// The mesh, with all triangles turned when its signed volume is negative.
TriangleMesh turned_outward(TriangleMesh mesh);

}  // namespace qjulia
