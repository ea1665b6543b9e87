#pragma once
/// Marching cubes over slices that arrive one after the other.

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "qjulia/mesh.hpp"

namespace qjulia {

/// Meshes the level set of a field given on the points of a grid, slice by slice (rising z). Keeps
/// two slices of the field and of vertex numbers. Inside is where the value is below the level (a
/// value that is not a number is outside). The mesh is closed and 2-manifold but where it meets the
/// grid's boundary, oriented outward, without coincident vertices; the same whatever the slices
/// come in.
class MarchingCubes {
 public:
  /// @param nx,ny points of a slice.
  /// @param reach differences from the level are clamped to it before interpolation; for fields
  ///   that jump.
  MarchingCubes(int nx, int ny, double level, double reach);

  /// The next slice, x fastest. @throws Error beyond 2³² vertices.
  void add(std::span<const float> slice);

  std::size_t triangle_count() const { return mesh_.triangles.size(); }

  /// The mesh so far; vertices in units of grid points.
  TriangleMesh take() { return std::move(mesh_); }

 private:
  /// What is known of one slice: the field relative to the level, which points are inside, and the
  /// vertices on its edges along x and y (set only where an edge is crossed).
  struct Slice {
    std::vector<float> difference;
    std::vector<std::uint8_t> inside;
    std::vector<std::uint32_t> on_x, on_y;
  };

  void classify(std::span<const float> values, Slice& slice) const;
  void cross_slice(Slice& slice);
  void cross_between();
  void mesh_layer();
  void mesh_cell(unsigned inside, std::size_t corner);
  std::uint32_t crossing(const Eigen::Vector3d& from, int axis, float below, float above);
  std::uint32_t add_vertex(const Eigen::Vector3d& position);
  Eigen::Vector3d point(std::size_t index, int z) const;

  std::size_t nx_, ny_;
  float level_, reach_;
  int slices_ = 0;  ///< slices seen
  Slice lower_, upper_;
  std::vector<std::uint32_t> on_z_;  ///< vertices on the edges from the lower to the upper slice
  TriangleMesh mesh_;
};

}  // namespace qjulia
