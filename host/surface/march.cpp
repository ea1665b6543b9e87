#include "surface/march.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <deque>
#include <future>

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

/// Points of the layer whose sides are unknown, numbered in its slices, x fastest, then y.
std::vector<std::int32_t> unknown_points(const Grid& grid, const Layer& layer) {
  std::vector<std::int32_t> numbers;
  std::int32_t row = 0;
  for (int k = 0; k < layer.slices; ++k) {
    for (int j = 0; j < grid.points[1]; ++j, row += grid.points[0]) {
      for (const Run& run : layer.row(j)) {
        if (run.side != Side::unknown) continue;
        for (int i = run.begin; i < run.end; ++i) numbers.push_back(row + i);
      }
    }
  }
  return numbers;
}

/// From layers to triangles, on a thread of its own: one is meshed while the next is evaluated.
class Mesher {
 public:
  Mesher(const LevelSet& set, double level, double reach, const Grid& grid, int halvings,
         Assembly& assembly)
      : set_(set),
        level_(level),
        grid_(grid),
        halvings_(halvings),
        assembly_(assembly),
        cubes_(grid.points, level, reach) {}

  /// Meshes the next layer, after the one before is done; `values` are taken, and become a buffer
  /// of no particular values. @throws what meshing the layer before threw.
  void add(const Layer& layer, std::vector<float>& values) {
    wait();
    std::swap(values_, values);
    layers_.push_back(layer);
    // The last slice of a layer is looked at once more, with the first one after it.
    if (layers_.size() > 2) layers_.pop_front();
    meshing_ = std::async(std::launch::async, [this] { mesh(); });
    // Vertices are refined on the device, which serves one thread at a time.
    if (halvings_ > 0) wait();
  }

  /// Until all that came is meshed.
  void wait() {
    if (!meshing_.valid()) return;
    meshing_.get();
    triangles_ = assembly_.triangles();
  }

  /// Of what was waited for.
  std::size_t triangles() const { return triangles_; }
  std::size_t open_edges() const { return open_edges_; }

 private:
  void mesh() {
    const Layer& layer = layers_.back();
    const std::size_t slice = slices(grid_, 0, 1).size();
    for (int k = 0; k < layer.slices; ++k) {
      cubes_.add(std::span(values_).subspan(static_cast<std::size_t>(k) * slice, slice), layer);
    }
    MeshPart part = cubes_.take();
    refine(set_, level_, grid_, halvings_, part.vertices);
    assembly_.add(part);
    open_edges_ += part.open_edges;
  }

  const LevelSet& set_;
  double level_;
  Grid grid_;
  int halvings_;
  Assembly& assembly_;
  MarchingCubes cubes_;
  std::size_t triangles_ = 0;
  std::size_t open_edges_ = 0;
  std::vector<float> values_;
  std::deque<Layer> layers_;
  std::future<void> meshing_;  ///< last: it ends before what it works on
};

/// A layer's values, being evaluated.
struct Evaluation {
  Layer layer;
  std::future<std::vector<float>> values;
};

}  // namespace

SurfaceReport march(const LevelSet& set, const LevelSet& second, double level, double reach,
                    const Grid& grid, const SurfaceOptions& options, Assembly& assembly,
                    const Watch& watch) {
  const int slices = grid.points[2];
  const Shell shell(set, grid, level);
  const Pace pace(slices, watch);
  Mesher mesher(set, level, reach, grid, options.refine, assembly);
  const auto evaluate = [&](const LevelSet& on, const Layer& layer, int z) {
    const GridBlock block = qjulia::slices(grid, z, layer.slices);
    if (options.dense) return on.densely_over(grid, block, level);
    std::vector<float> values(block.size());
    on.clamped_at(grid, block, unknown_points(grid, layer), {level, reach}, values);
    return values;
  };
  std::deque<Evaluation> under_way;
  int meshed = 0;
  const auto mesh_first = [&] {
    std::vector<float> values = under_way.front().values.get();
    mesher.add(under_way.front().layer, values);
    meshed += under_way.front().layer.slices;
    under_way.pop_front();
    pace.report(meshed, mesher.triangles());
  };
  // Refined vertices are looked at on the first queue, and so are blocks: neither beside a layer.
  const std::size_t at_once = options.refine > 0 ? 1 : 2;
  bool on_second = false;
  for (int z = 0; z < slices;) {
    while (!under_way.empty()) mesh_first();
    const std::vector<Layer> layers =
        options.dense ? std::vector{unknown_layer(grid, std::min(slices_at_once(grid), slices - z))}
                      : shell.layers(z);
    for (const Layer& layer : layers) {
      if (watch.stop.stop_requested()) throw Interrupted();
      if (under_way.size() == at_once) mesh_first();
      const LevelSet& on = on_second ? second : set;
      under_way.push_back({layer, std::async(std::launch::async, [&evaluate, &on, layer, z] {
                             return evaluate(on, layer, z);
                           })});
      if (at_once > 1) on_second = !on_second;
      z += layer.slices;
    }
  }
  while (!under_way.empty()) mesh_first();
  mesher.wait();
  SurfaceReport report;
  report.vertices = assembly.vertices();
  report.triangles = assembly.triangles();
  report.open_edges = mesher.open_edges();
  return report;
}

}  // namespace qjulia
