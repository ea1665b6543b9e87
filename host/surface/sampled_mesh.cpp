#include <algorithm>
#include <limits>

#include "qjulia/error.hpp"
#include "qjulia/original_file.hpp"
#include "qjulia/surface.hpp"
#include "surface/marching_cubes.hpp"

namespace qjulia {

TriangleMesh mesh_of(const SampledDistance& distance) {
  surface::Grid grid;
  grid.points = distance.samples;
  const auto [nx, ny, nz] = grid.points;
  MeshSink sink;
  surface::MarchingCubes cubes(grid.points, 0, std::numeric_limits<double>::infinity());
  surface::MeshBuilder builder(grid, {}, sink);
  const surface::Slab slab = surface::unclassified_slab(grid, nz);
  const std::size_t size = static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny);
  std::vector<float> slice(size);
  for (std::size_t k = 0; k < static_cast<std::size_t>(nz); ++k) {
    const auto from = distance.values.begin() + static_cast<std::ptrdiff_t>(k * size);
    std::transform(from, from + static_cast<std::ptrdiff_t>(size), slice.begin(),
                   [](double d) { return static_cast<float>(d); });
    cubes.add(slice, slab);
  }
  const surface::MeshPart part = cubes.take();
  if (part.open_edges > 0) {
    throw InputError("the distance field's shape reaches its faces: it needs a margin");
  }
  if (part.triangles.empty()) {
    throw InputError("the distance field has no inside: distances there must be negative");
  }
  builder.add(part);
  // Samples are at the middles of cells, whose sides may differ.
  const Eigen::Vector3d cell = distance.lengths.cwiseQuotient(Eigen::Vector3d(nx, ny, nz));
  const Eigen::Vector3d first = distance.center - 0.5 * distance.lengths + 0.5 * cell;
  for (Eigen::Vector3d& x : sink.mesh.vertices) x = first + cell.cwiseProduct(x);
  sink.mesh.normals.clear();
  return std::move(sink.mesh);
}

}  // namespace qjulia
