#include "surface/march.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "qjulia/error.hpp"
#include "surface/refine.hpp"
#include "surface/shell.hpp"

namespace qjulia {
namespace {

/// Progress by slices done.
class Pace {
 public:
  Pace(int slices, const Watch& watch) : slices_(slices), watch_(watch) {}

  void report(int done, std::size_t triangles) const {
    const double fraction = static_cast<double>(done) / slices_;
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start_;
    watch_.report({"extracting the surface", fraction, taken.count() * (1 - fraction) / fraction,
                   fmt::format("{} triangles", triangles)});
  }

 private:
  int slices_;
  const Watch& watch_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// F_n where the layer's sides are unknown, into `values`: the slices z … z + layer.slices − 1.
void fill(const LevelSet& set, const Grid& grid, int z, const Layer& layer,
          std::vector<float>& values) {
  PointList points;
  std::vector<std::size_t> numbers;
  const auto nx = static_cast<std::size_t>(grid.points[0]);
  std::size_t row = 0;
  for (int k = 0; k < layer.slices; ++k) {
    const double pz = grid.coordinate(2, z + k, set.precision());
    for (int j = 0; j < grid.points[1]; ++j, row += nx) {
      const double py = grid.coordinate(1, j, set.precision());
      for (const Run& run : layer.row(j)) {
        if (run.side != Side::unknown) continue;
        for (int i = run.begin; i < run.end; ++i) {
          points.add(grid.coordinate(0, i, set.precision()), py, pz);
          numbers.push_back(row + static_cast<std::size_t>(i));
        }
      }
    }
  }
  const std::vector<float> found = set.at(points);
  for (std::size_t i = 0; i < found.size(); ++i) values[numbers[i]] = found[i];
}

}  // namespace

SurfaceReport march(const LevelSet& set, double level, double reach, const Grid& grid,
                    const SurfaceOptions& options, Assembly& assembly, const Watch& watch) {
  SurfaceReport report;
  const int slices = grid.points[2];
  const std::size_t slice = GridBlock{{0, 0, 0}, {grid.points[0], grid.points[1], 1}}.size();
  MarchingCubes cubes(grid.points, level, reach);
  const Shell shell(set, grid, level);
  const Pace pace(slices, watch);
  std::vector<float> values;
  // The layers before these are looked at once more, with the first slice after them.
  std::vector<Layer> layers;
  std::vector<Layer> earlier;
  for (int z = 0; z < slices;) {
    earlier = std::move(layers);
    if (options.dense) {
      layers = {unknown_layer(grid, std::min(slices_at_once(grid), slices - z))};
    } else {
      layers = shell.layers(z);
    }
    for (const Layer& layer : layers) {
      if (watch.stop.stop_requested()) throw Interrupted();
      if (options.dense) {
        values = set.densely_over(grid, qjulia::slices(grid, z, layer.slices));
      } else {
        values.resize(slice * static_cast<std::size_t>(layer.slices));
        fill(set, grid, z, layer, values);
      }
      for (int k = 0; k < layer.slices; ++k) {
        cubes.add(std::span(values).subspan(static_cast<std::size_t>(k) * slice, slice), layer);
      }
      z += layer.slices;
      MeshPart part = cubes.take();
      refine(set, level, grid, options.refine, part.vertices);
      assembly.add(part);
      report.open_edges += part.open_edges;
      pace.report(z, assembly.triangles());
    }
  }
  report.vertices = assembly.vertices();
  report.triangles = assembly.triangles();
  return report;
}

}  // namespace qjulia
