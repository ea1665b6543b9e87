#pragma once
/// The set as a triangle mesh.

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <stop_token>

#include "qjulia/base/progress.hpp"
#include "qjulia/map/field.hpp"
#include "qjulia/mesh/mesh.hpp"

namespace qjulia {

struct SurfaceOptions {
  int resolution = 256;      ///< cells along the box's longest side, 2 … 8192
  int iterations = 6;        ///< n; 1 is the fitted potential itself
  std::optional<Box> box{};  ///< shape units; by default the shape's box plus 5 %, grown until
                             ///< nothing touches its faces
  bool dense = false;        ///< iterate every point of the grid: the same mesh as `exact`, slower
  /// Compute every orbit. By default the sides of grid points come from tables of images where
  /// those take less time and are estimated to move the surface by no more than a quarter of a
  /// cell: in large grids of maps of many factors without portals, at n > 1. Vertices are placed by
  /// computed orbits. Tips of tufts as thin as a cell may come or go.
  bool exact = false;
  /// How many points are tried on each crossed edge to find where the set ends, 0 … 20. By default
  /// 2, and 0 at n = 1, where F_n is smooth and interpolation is enough.
  std::optional<int> refine{};
  Precision precision =
      Precision::single;  ///< arithmetic of the orbits; double where the device has it
  /// Radius beyond which orbits end, map units; by default where none returns from.
  std::optional<double> escape = std::nullopt;
  void validate() const;  ///< @throws InputError
};

/// Counts of an extraction.
struct SurfaceReport {
  std::size_t vertices = 0;
  std::size_t triangles = 0;
  std::size_t open_edges = 0;        ///< where the box cuts the set; two triangles share any other
  std::uint64_t grid_points = 0;     ///< points that the grid has
  std::uint64_t potentials = 0;      ///< points where F_1 was evaluated, not interpolated
  std::uint64_t settled = 0;         ///< points settled by interpolated F_1 and images
  std::uint64_t nodes = 0;           ///< points from which these were interpolated
  std::uint64_t iterated = 0;        ///< points whose orbits were iterated beyond F_1
  std::uint64_t iterates = 0;        ///< second and further iterates of these, all together
  std::uint64_t bounded_blocks = 0;  ///< blocks of points over which F_1 was bounded
  double trusted_share = 0;  ///< of cells of nodes: those that first iterates are looked up in
};
/// The counts of evaluations: grid, potentials, settled, nodes, iterated, iterates, bounded_blocks;
/// and trusted_share.
nlohmann::json to_json(const SurfaceReport& report);

/// Takes a mesh piece by piece, as it is made.
class SurfaceSink {
 public:
  virtual ~SurfaceSink() = default;
  /// The next vertices, shape units, numbered from 0 in the order in which they come. Normals are
  /// unit vectors, outward: the area-weighted mean of the triangles around the vertex.
  virtual void vertices(std::span<const Eigen::Vector3d> positions,
                        std::span<const Eigen::Vector3d> normals) = 0;
  /// The next triangles. Their vertices come before or after them.
  virtual void triangles(std::span<const Triangle> triangles) = 0;
};

/// Keeps a mesh in memory.
class MeshSink : public SurfaceSink {
 public:
  void vertices(std::span<const Eigen::Vector3d> positions,
                std::span<const Eigen::Vector3d> normals) override;
  void triangles(std::span<const Triangle> triangles) override;

  TriangleMesh mesh;
};

/// Marching cubes of F_n = L, evaluated on the device slab by slab. Vertices are shared, and lie
/// where the set ends (`SurfaceOptions::refine`); the mesh is closed and 2-manifold where the set
/// stays clear of the box, and oriented outward. It has no triangles when the box holds no surface.
/// F_1 is bounded over blocks of points, evaluated where these bounds do not settle the side, and
/// iterated where F_1 does not: the cost grows with the band about the surface. Memory is that of a
/// few slabs.
/// @throws InputError naming the option or what is wrong with the map; Error when no box is clear
///   of the set, or beyond 2³² vertices.
SurfaceReport extract_surface(const Device& device, const Map& map, const SurfaceOptions& options,
                              SurfaceSink& sink, const ProgressMonitor& monitor = {});

/// The same, in memory; with a `MeshSink` instead, the report comes too.
TriangleMesh extract_surface(const Device& device, const Map& map, const SurfaceOptions& options,
                             const ProgressMonitor& monitor = {});

/// Whether the set holds any of 65,536 random points of the box, or the origin of iteration if that
/// lies in the box. If it does although `extract_surface` found no surface, the set is too thin for
/// the grid and needs more cells.
/// @throws as `extract_surface`
bool has_points(const Device& device, const Map& map, const SurfaceOptions& options,
                const std::stop_token& stop = {});

}  // namespace qjulia
