#include "qjulia/surface.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "map/box_option.hpp"
#include "qjulia/error.hpp"
#include "qjulia/shared/map_layout.h"
#include "surface/clear_box.hpp"
#include "surface/level_set.hpp"
#include "surface/march.hpp"
#include "surface/set_surface.hpp"

namespace qjulia {
namespace {

constexpr int kMostCells = 8192;
constexpr int kMostHalvings = 20;
/// F_1 is smooth and is interpolated as it is. Further iterates jump where orbits part: there a
/// difference from the level is as good as any larger one when orbits that far off have ended, at
/// r_in or r_out. Larger ones put vertices farther from bisected ones (with 2 they are a fifth
/// farther off; bunny, n = 6, 384 cells); less than a quarter flattens where iterates are smooth.
constexpr double kLeastReach = 0.25, kMostReach = 1;
/// The shape's box is widened by this on each side to begin with.
constexpr double kMargin = 0.05;

/// No point of the set is farther from the origin, map units.
double farthest_inside(const StopRadii& stops) {
  return std::isfinite(stops.outer) && stops.outer > 0 ? stops.outer : stops.escape;
}

double reach_about(double level, const StopRadii& stops, int iterations) {
  if (iterations == 1) return std::numeric_limits<double>::infinity();
  const double nearer = std::min(level - std::log(stops.inner), std::log(stops.outer) - level);
  return std::clamp(nearer, kLeastReach, kMostReach);
}

Box starting_box(const LevelSet& set, const RationalMap& map, const StopRadii& stops) {
  if (map.box) {
    const Eigen::Vector3d margin = Eigen::Vector3d::Constant(kMargin * map.box->size().maxCoeff());
    return {map.shape_to_map.to_map(map.box->low - margin),
            map.shape_to_map.to_map(map.box->high + margin)};
  }
  const Eigen::Vector3d reach = Eigen::Vector3d::Constant(farthest_inside(stops));
  return tightened(set, map.surface_level, {-reach, reach});
}

}  // namespace

void SurfaceOptions::validate() const {
  if (resolution < 2 || resolution > kMostCells) {
    throw InputError(
        fmt::format("--resolution {} is out of range; give 2 … {} cells", resolution, kMostCells));
  }
  if (iterations < 1 || iterations > QJ_MOST_ITERATIONS) {
    throw InputError(fmt::format("--iterations {} is out of range; give 1 … {}", iterations,
                                 QJ_MOST_ITERATIONS));
  }
  if (refine < 0 || refine > kMostHalvings) {
    throw InputError(
        fmt::format("--refine {} is out of range; give 0 … {} halvings", refine, kMostHalvings));
  }
  expect_box(box);
}

SurfaceReport set_surface(const Device& device, const RationalMap& map, const StopRadii& stops,
                          const SurfaceOptions& options, SurfaceSink& sink, const Watch& watch) {
  LevelSet set(device, map, stops, options.iterations, options.precision);
  Box box;
  if (options.box) {
    box = {map.shape_to_map.to_map(options.box->low), map.shape_to_map.to_map(options.box->high)};
  } else {
    box = grown_clear(set, map.surface_level, starting_box(set, map, stops), options.resolution,
                      2 * farthest_inside(stops), watch);
  }
  const Grid grid = grid_over(box, options.resolution);
  const double reach = reach_about(map.surface_level, stops, options.iterations);
  Assembly assembly(grid, map.shape_to_map, sink);
  const Device sibling = device.sibling();
  const LevelSet second(sibling, map, stops, options.iterations, options.precision);
  set.reset_counts();
  SurfaceReport report =
      march(set, second, map.surface_level, reach, grid, options, assembly, watch);
  sibling.record(nullptr);
  LevelSetCounts counts = set.counts();
  counts += second.counts();
  report.grid_points = GridBlock{{0, 0, 0}, grid.points}.size();
  report.potentials = counts.potentials;
  report.settled = counts.settled;
  report.nodes = counts.nodes;
  report.iterated = counts.iterated;
  report.iterates = counts.iterates;
  report.bounded_blocks = counts.cubes;
  return report;
}

void MeshSink::vertices(std::span<const Eigen::Vector3d> positions,
                        std::span<const Eigen::Vector3d> normals) {
  mesh.vertices.insert(mesh.vertices.end(), positions.begin(), positions.end());
  for (const Eigen::Vector3d& normal : normals) mesh.normals.push_back(normal.cast<float>());
}

void MeshSink::triangles(std::span<const Triangle> triangles) {
  mesh.triangles.insert(mesh.triangles.end(), triangles.begin(), triangles.end());
}

SurfaceReport extract_surface(const Device& device, const RationalMap& map,
                              const SurfaceOptions& options, SurfaceSink& sink,
                              const Watch& watch) {
  options.validate();
  map.validate();
  return set_surface(device, map, find_stop_radii(device, map, options.escape), options, sink,
                     watch);
}

TriangleMesh extract_surface(const Device& device, const RationalMap& map,
                             const SurfaceOptions& options, const Watch& watch,
                             SurfaceReport* report) {
  MeshSink sink;
  const SurfaceReport made = extract_surface(device, map, options, sink, watch);
  if (report != nullptr) *report = made;
  return std::move(sink.mesh);
}

nlohmann::json to_json(const SurfaceReport& report) {
  return {{"grid", report.grid_points},
          {"potentials", report.potentials},
          {"settled", report.settled},
          {"nodes", report.nodes},
          {"iterated", report.iterated},
          {"iterates", report.iterates},
          {"bounded_blocks", report.bounded_blocks}};
}

}  // namespace qjulia
