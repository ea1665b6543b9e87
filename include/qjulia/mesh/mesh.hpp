#pragma once
/// Triangle meshes and their files.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "qjulia/base/box.hpp"
#include "qjulia/base/up_axis.hpp"

namespace qjulia {

using Triangle = std::array<std::uint32_t, 3>;

/// Red, green and blue, sRGB.
using VertexColor = std::array<std::uint8_t, 3>;

struct TriangleMesh {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Triangle> triangles;  ///< counter-clockwise from outside
  /// Outward normals of vertices, of length 1; or none. Never read; formats that hold them: .ply,
  /// .obj, .glb and .usda.
  std::vector<Eigen::Vector3f> normals{};
  /// Colours of vertices; or none. Never read; `holds_colors` says which files hold them.
  std::vector<VertexColor> colors{};
  /// The axis that points up in files of the format that the mesh was read from, where the format
  /// defines one. `guess_up` returns it unless the mesh's form clearly says otherwise.
  std::optional<UpAxis> format_up{};

  Box box() const;
  /// Every function of this library that takes a mesh calls this.
  /// @throws InputError naming the vertex or triangle, when a number is not finite, an index has no
  ///   vertex, or normals or colours are not one for each vertex.
  void validate() const;
};

/// What a mesh is like as a surface.
struct MeshReport {
  /// The index of a vertex of which no triangle is left.
  static constexpr std::uint32_t kNoVertex = ~0U;
  std::size_t vertices = 0;
  std::size_t triangles = 0;
  std::size_t components = 0;
  std::size_t open_edges = 0;          ///< edges with one triangle
  std::size_t non_manifold_edges = 0;  ///< edges with more than two triangles, or badly oriented
  std::size_t welded_vertices = 0;     ///< duplicates merged while reading
  std::size_t dropped_triangles = 0;   ///< without area, removed while reading
  std::size_t points = 0;        ///< of a file without faces; their cells are cut into `triangles`
  std::size_t bad_polygons = 0;  ///< crossing themselves or without area, cut up while reading
  std::size_t duplicate_triangles = 0;  ///< with the corners and winding of another, removed
  std::size_t two_sided_triangles = 0;  ///< pairs with the same corners and opposite windings
  bool is_two_sided = false;            ///< all were in such pairs; the first of each is left
  bool is_inside_out = false;           ///< `oriented_outward` turns all its triangles
  std::size_t turned_parts = 0;         ///< components that `oriented_outward` turns
  double rounding = 0;  ///< of coordinates in single precision, as mesh files are read and written,
                        ///< over the longest side
  /// For each vertex of the file, in the file's order, the mesh's vertex that it became, or
  /// `kNoVertex`. A scene's meshes follow one another; an .stl file has three vertices for each
  /// triangle. Empty where the file has points and no faces.
  std::vector<std::uint32_t> vertex_of_file{};
  bool closed() const { return open_edges == 0 && non_manifold_edges == 0; }
  /// One sentence a line on what a user should know; empty for a clean mesh.
  std::vector<std::string> warnings() const;
};

/// Reads a mesh by its extension (docs/reference/file-types.md), with coordinates in single
/// precision. Polygons are cut into triangles, equal vertices welded, and triangles without area,
/// triangles that repeat another and vertices without triangles left out. What is left keeps the
/// file's order; of equal vertices the first stays. Nothing else is lost: open, non-manifold and
/// inside-out meshes and triangle soups come as they are.
///
/// Scenes (.glb, .gltf, .3mf) come as one mesh, in the coordinates of the scene: those of glTF have
/// Y up; those of .3mf are millimetres, whatever its unit, with Z up. Skins and morph targets are
/// left out. A .gltf file may name other files in its folder.
///
/// A .ply file of points with normals (nx, ny, nz) and without faces is read as one polygon for
/// each point: the part of the plane across its normal that is nearer to it than to its neighbours.
/// Distances and winding numbers of these polygons approximate those of the surface that the points
/// were taken from.
/// @param stop ends reading.
/// @throws InputError naming the file: missing, empty, of another type, truncated, an index out of
///   range, a coordinate that is not finite or beyond ±1e12, no triangle with area, a longest side
///   below 1e-12, points without normals, compressed (by Draco, meshopt or encryption), or a scene
///   whose repeated parts or packed data would make it much larger than its file.
TriangleMesh read_mesh(const std::filesystem::path& path, std::stop_token stop = {});

/// A mesh, and what is wrong with the file it came from.
struct InspectedMesh {
  TriangleMesh mesh;
  MeshReport report;
};
/// The same, with a report of what was found and left out.
InspectedMesh read_and_inspect_mesh(const std::filesystem::path& path, std::stop_token stop = {});
/// The mesh as it would be read from a file that holds it, so that results of the two are the same,
/// bit for bit. Normals and colours are left out.
/// @throws InputError as for a file, and where the mesh is not valid.
InspectedMesh as_if_read(const TriangleMesh& mesh, const std::stop_token& stop = {});

/// How a mesh is written, and what its file holds besides its triangles.
struct MeshFileOptions {
  /// A line of text, ASCII: a comment of .ply, .obj and .usda, in .glb under asset.extras, in .3mf
  /// its description. Other formats have no room for it.
  std::string note{};
  /// The mesh's axis that points up. Formats with an up of their own then stand upright: .glb and
  /// .usda with Y up, .stl and .3mf with Z up. If it is not set, Z is up.
  std::optional<UpAxis> up{};
  /// For .ply, .obj and .off, which have no up: the file's axis that `up` (by default `kDefaultUp`)
  /// is turned to. By default they keep the mesh's own coordinates.
  std::optional<UpAxis> file_up{};
  /// The object's name in .glb, .obj, .usda and .3mf; by default the file's name.
  std::string name{};
  /// What a unit of the mesh's coordinates measures, above 0. By default it is the format's own
  /// unit: a metre in .glb and .usda, a millimetre in .3mf. Other formats have no unit.
  std::optional<double> metres_per_unit{};
  /// The map that the mesh shows, as `packed_map` makes it: `read_map` then reads the .glb. Other
  /// formats hold none. Empty: none.
  std::string map{};

  /// The rotation of meshes in formats that have no up.
  Eigen::Matrix3d file_turn() const;
  void validate() const;  ///< @throws OptionError
};

/// Writes by extension (docs/reference/file-types.md), coordinates in single precision, under a
/// temporary name that is renamed. In .3mf each connected part is an object, together with its
/// cavities. Beside a coloured .obj, a material of the mean colour is written under the same name
/// with .mtl.
/// @throws OutputError when the file cannot be written, InputError for another extension.
void write_mesh(const TriangleMesh& mesh, const std::filesystem::path& path,
                const MeshFileOptions& options);
/// The same with a note and with how the mesh stands.
void write_mesh(const TriangleMesh& mesh, const std::filesystem::path& path,
                const std::string& note = {}, std::optional<UpAxis> up = {});

/// The axis that points up in files of this name, where their format defines one: y in .glb, .gltf
/// and .usda, z in .stl and .3mf, none in others. `write_mesh` makes meshes stand upright along it.
std::optional<UpAxis> format_up(const std::filesystem::path& path);

/// Whether `write_mesh` writes the colours of meshes, and not only their triangles, under this
/// name.
bool holds_colors(const std::filesystem::path& path);

/// How a mesh probably stands: with its flattest, widest end down. That end has to be clearly
/// flatter and wider than that of the default, which is `format_up` or, without it, `kDefaultUp`.
UpAxis guess_up(const TriangleMesh& mesh);

MeshReport inspect(const TriangleMesh& mesh);

/// Volume enclosed by a closed mesh, negative when it is inside out (divergence theorem). For an
/// open one, the volume of the cones from its triangles to the centroid of its area.
double signed_volume(const TriangleMesh& mesh);

/// The mesh with those of its parts turned that are wound inside out. Whatever needs the inside of
/// a mesh uses that of this one. Triangles that share vertices belong to the same part.
///
/// A part that encloses a volume (it may have holes) lies in another one when most of its area
/// does. It is turned when it is wound inside out and does not lie in the material of others, and
/// then the parts in it are turned with it. Cavities therefore stay cavities, even those that stick
/// out of the body they are cut from. Parts that enclose nothing, such as sheets and the triangles
/// of a soup, are turned together if the mesh would otherwise have a negative volume.
/// @throws Interrupted
TriangleMesh oriented_outward(TriangleMesh mesh, const std::stop_token& stop = {});

}  // namespace qjulia
