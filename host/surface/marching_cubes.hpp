#pragma once
/// Marching cubes over slices that arrive one after the other, and the mesh they make.

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "qjulia/mesh/mesh.hpp"
#include "qjulia/surface/surface.hpp"
#include "surface/edge_vertex.hpp"
#include "surface/narrow_band.hpp"

namespace qjulia::surface {

/// What some slices have added to a mesh.
struct MeshPart {
  std::uint32_t first = 0;  ///< number of the first of `vertices`
  std::vector<EdgeVertex> vertices;
  std::vector<Triangle> triangles;  ///< by vertex numbers, also of earlier parts
  std::size_t open_edges = 0;       ///< on the grid's boundary
  std::uint32_t complete = 0;       ///< vertices before this one have all their triangles
};

/// Meshes the level set of a field given on the points of a grid, slice by slice (rising z). Keeps
/// two slices of the field and of vertex numbers, and visits only points whose sides are unknown.
/// Inside is where the value is below the level (a value that is not a number is outside). The mesh
/// is closed and 2-manifold but where it meets the grid's boundary, oriented outward, without
/// coincident vertices; the same whatever the slabs, and however the parts are taken.
class MarchingCubes {
 public:
  MarchingCubes(const Eigen::Vector3i& points, double level, const DifferenceScale& scale = {});

  /// The next slice, x fastest; values of points whose sides are known are ignored. `slab` must
  /// live until the slice after this one was added.
  /// @throws Error beyond 2³² vertices.
  void add(std::span<const float> slice, const Slab& slab);

  /// Takes what was added since the last call.
  MeshPart take();
  /// How many vertices were added since the last `take`.
  std::size_t waiting() const { return part_.vertices.size(); }

 private:
  /// What is known of one slice: the field relative to the level, which points are inside, and the
  /// vertices on its edges along x and y (set only where an edge is crossed).
  struct Slice {
    const Slab* slab = nullptr;
    std::vector<float> difference;
    std::vector<std::uint8_t> inside;
    std::vector<std::uint32_t> on_x, on_y;
  };

  void classify(std::span<const float> values);
  void cross_slice();
  void cross_between();
  void mesh_layer();
  void mesh_cell(unsigned inside, std::size_t i);
  std::uint32_t crossing(std::size_t index, int z, int axis, float at_start, float at_end);
  std::uint32_t next_vertex() const {
    return part_.first + static_cast<std::uint32_t>(part_.vertices.size());
  }

  Eigen::Vector3i points_;
  std::size_t nx_, ny_;
  float level_, reach_, flatten_;
  int slices_ = 0;  ///< slices seen
  Slice lower_, upper_;
  std::vector<std::uint32_t> on_z_;  ///< vertices on the edges from the lower to the upper slice
  MeshPart part_;
};

/// Places the parts' vertices, computes their normals and hands both on to a sink. Keeps only those
/// vertices that further triangles can still use.
class MeshBuilder {
 public:
  MeshBuilder(const Grid& grid, const ShapeToMap& shape_to_map, SurfaceSink& sink)
      : grid_(grid), shape_to_map_(shape_to_map), sink_(sink) {}

  void add(const MeshPart& part);

  std::size_t vertices() const { return first_ + positions_.size(); }
  std::size_t triangles() const { return triangles_; }

 private:
  Grid grid_;
  ShapeToMap shape_to_map_;
  SurfaceSink& sink_;
  std::uint32_t first_ = 0;                 ///< number of the first vertex kept
  std::vector<Eigen::Vector3d> positions_;  ///< shape units
  std::vector<Eigen::Vector3d> normals_;    ///< sums of triangles' area vectors, twice
  std::size_t triangles_ = 0;
};

}  // namespace qjulia::surface
