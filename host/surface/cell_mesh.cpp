#include "qjulia/surface/cell_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/range_check.hpp"
#include "lattice/grid.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/base/progress.hpp"
#include "qjulia/mesh/shape.hpp"
#include "surface/marching_cubes.hpp"

namespace qjulia {
namespace {

constexpr int kLeastSeenCells = 16, kMostSeenCells = 1024;
constexpr int kBlockSide = 4;  // points along the side of a block

/// Distances on four slices of a grid. A distance changes by no more than the way: where it is
/// large in the middle of a block, it stands for the whole block.
class BlockLayer {
 public:
  BlockLayer(const SignedDistance& distance, const surface::Grid& grid)
      : distance_(distance), grid_(grid) {}

  /// Slice after slice from z on, x fastest.
  std::vector<float> slices(int z, int count, const std::stop_token& stop) const {
    const Eigen::Vector3i& points = grid_.points;
    const auto wide = static_cast<std::size_t>(points.x()),
               high = static_cast<std::size_t>(points.y());
    std::vector<Eigen::Vector3d> middles;
    for (int y = 0; y < points.y(); y += kBlockSide) {
      for (int x = 0; x < points.x(); x += kBlockSide) {
        middles.push_back(
            grid_.at(Eigen::Vector3d(x, y, z) + Eigen::Vector3d::Constant(0.5 * (kBlockSide - 1))));
      }
    }
    const std::vector<double> coarse = distance_.at(middles, stop);
    const double reach = grid_.step * (0.5 * kBlockSide * std::sqrt(3.0) + 1);
    const std::size_t blocks = (wide + kBlockSide - 1) / kBlockSide;
    std::vector<float> values(wide * high * static_cast<std::size_t>(count));
    std::vector<Eigen::Vector3d> near;
    std::vector<std::size_t> numbers;
    std::size_t number = 0;
    for (int k = 0; k < count; ++k) {
      for (int y = 0; y < points.y(); ++y) {
        for (int x = 0; x < points.x(); ++x, ++number) {
          const double middle = coarse[static_cast<std::size_t>(y / kBlockSide) * blocks +
                                       static_cast<std::size_t>(x / kBlockSide)];
          values[number] = static_cast<float>(middle);
          if (std::abs(middle) > reach) continue;
          near.push_back(grid_.point({x, y, z + k}));
          numbers.push_back(number);
        }
      }
    }
    const std::vector<double> exact = distance_.at(near, stop);
    for (std::size_t i = 0; i < exact.size(); ++i) {
      values[numbers[i]] = static_cast<float>(exact[i]);
    }
    return values;
  }

 private:
  const SignedDistance& distance_;
  const surface::Grid& grid_;
};

}  // namespace

TriangleMesh cell_mesh(const Device& device, const TriangleMesh& mesh, int cells,
                       const std::stop_token& stop) {
  base::expect_between("cells", cells, kLeastSeenCells, kMostSeenCells);
  mesh.validate();
  const SignedDistance distance(device, mesh, Precision::single, stop);
  const Box box = mesh.box();
  // Points lie half a step off the box's faces.
  const surface::Grid grid =
      surface::grid_around(box, box.size().maxCoeff() / cells, /*margin=*/1.5);
  surface::MarchingCubes cubes(grid.points, 0);
  MeshSink sink;
  surface::MeshBuilder builder(grid, {}, sink);
  const surface::Slab slab = surface::unclassified_slab(grid, grid.points.z());
  const BlockLayer layer(distance, grid);
  const std::size_t slice = surface::slices(grid, 0, 1).size();
  for (int z = 0; z < grid.points.z(); z += kBlockSide) {
    throw_if_stopped(stop);
    const int count = std::min(kBlockSide, grid.points.z() - z);
    const std::vector<float> values = layer.slices(z, count, stop);
    for (int k = 0; k < count; ++k) {
      cubes.add(std::span(values).subspan(static_cast<std::size_t>(k) * slice, slice), slab);
    }
    builder.add(cubes.take());
  }
  if (sink.mesh.triangles.empty()) {
    throw InputError("the mesh has no inside that cells of this size see; it is open, or thinner");
  }
  return std::move(sink.mesh);
}

}  // namespace qjulia
