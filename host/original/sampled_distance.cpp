#include <fmt/format.h>

#include <utility>

#include "original/original_file.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/surface/surface.hpp"
#include "surface/marching_cubes.hpp"

namespace qjulia::original {
namespace {

void check(const SampledDistance& distance) {
  const Eigen::Array3i samples(distance.samples.data());
  if ((samples < 2).any() || (samples > 8192).any() ||
      distance.values.size() != static_cast<std::size_t>(samples.cast<double>().prod())) {
    throw InputError(fmt::format("the distance field has {} values, and {} x {} x {} samples",
                                 distance.values.size(), samples[0], samples[1], samples[2]));
  }
  if (!distance.center.allFinite() || !distance.lengths.allFinite() ||
      !(distance.lengths.array() > 0).all()) {
    throw InputError("the distance field's box has no size, or is not finite");
  }
}

}  // namespace

TriangleMesh mesh_of(const SampledDistance& distance) {
  check(distance);
  surface::Grid grid;
  grid.points = Eigen::Vector3i(distance.samples.data());
  MeshSink sink;
  surface::MarchingCubes cubes(grid.points, 0);
  surface::MeshBuilder builder(grid, {}, sink);
  const surface::Slab slab = surface::unclassified_slab(grid, grid.points.z());
  std::vector<float> slice(surface::slices(grid, 0, 1).size());
  auto next = distance.values.begin();
  for (int k = 0; k < grid.points.z(); ++k) {
    for (float& value : slice) value = static_cast<float>(*next++);
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
  const Eigen::Vector3d cell = distance.lengths.cwiseQuotient(grid.points.cast<double>());
  const Eigen::Vector3d first = distance.center - 0.5 * distance.lengths + 0.5 * cell;
  for (Eigen::Vector3d& x : sink.mesh.vertices) x = first + cell.cwiseProduct(x);
  sink.mesh.normals.clear();
  return std::move(sink.mesh);
}

}  // namespace qjulia::original
