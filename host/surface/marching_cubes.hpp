#pragma once
/// Marching cubes over slices that arrive one after the other.

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "qjulia/mesh.hpp"
#include "surface/shell.hpp"

namespace qjulia {

/// Vertices keep this far from grid points, in steps: no two of them coincide.
constexpr float kVertexMargin = 0.01F;

/// A vertex on the grid edge that leads from a point one step along an axis.
struct EdgeVertex {
  std::array<int, 3> point{};
  int axis = 0;               ///< kNoEdge: it stands for the mean of other vertices
  float at = 0;               ///< 0 at `point`, 1 at the edge's other end
  bool leads_inside = false;  ///< `point` is outside

  static constexpr int kNoEdge = 3;
};

/// A vertex at the mean of others.
struct MeanVertex {
  std::uint32_t number = 0;
  std::vector<std::uint32_t> of;
};

/// What some slices have added to a mesh.
struct MeshPart {
  std::uint32_t first = 0;  ///< number of the first of `vertices`
  std::vector<EdgeVertex> vertices;
  std::vector<MeanVertex> means;    ///< rising numbers
  std::vector<Triangle> triangles;  ///< by vertex numbers, also of earlier parts
  std::size_t open_edges = 0;       ///< on the grid's boundary
  std::uint32_t complete = 0;       ///< vertices before this one have all their triangles
};

/// Meshes the level set of a field given on the points of a grid, slice by slice (rising z). Keeps
/// two slices of the field and of vertex numbers, and looks only where a layer's sides are unknown.
/// Inside is where the value is below the level (a value that is not a number is outside). The mesh
/// is closed and 2-manifold but where it meets the grid's boundary, oriented outward, without
/// coincident vertices; the same whatever the layers, and however the parts are taken.
class MarchingCubes {
 public:
  /// @param reach differences from the level are clamped to it before interpolation; for fields
  ///   that jump.
  MarchingCubes(const std::array<int, 3>& points, double level, double reach);

  /// The next slice, x fastest; of values where a side is known no notice is taken. `layer` must
  /// live until the slice after this one was added.
  /// @throws Error beyond 2³² vertices.
  void add(std::span<const float> slice, const Layer& layer);

  /// What was added since the last call.
  MeshPart take();

 private:
  /// What is known of one slice: the field relative to the level, which points are inside, and the
  /// vertices on its edges along x and y (set only where an edge is crossed).
  struct Slice {
    const Layer* layer = nullptr;
    std::vector<float> difference;
    std::vector<std::uint8_t> inside;
    std::vector<std::uint32_t> on_x, on_y;
  };

  /// Calls f(first point's index, count) for the runs of unknown side, rising.
  template <class F>
  void each_unknown(const Slice& slice, F f) const;
  void classify(std::span<const float> values, Slice& slice) const;
  void cross_slice(Slice& slice);
  void cross_between();
  void mesh_layer();
  void mesh_cell(unsigned inside, std::size_t corner);
  void count_open_edges(unsigned inside, std::size_t corner);
  std::uint32_t crossing(std::size_t index, int z, int axis, float below, float above);
  std::uint32_t add_vertex(const EdgeVertex& vertex);

  std::array<int, 3> points_;
  std::size_t nx_, ny_;
  float level_, reach_;
  int slices_ = 0;  ///< slices seen
  Slice lower_, upper_;
  std::vector<std::uint32_t> on_z_;  ///< vertices on the edges from the lower to the upper slice
  MeshPart part_;
};

}  // namespace qjulia
