#include "qjulia/surface.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <span>

#include "qjulia/error.hpp"
#include "qjulia/shared/map_layout.h"
#include "surface/clear_box.hpp"
#include "surface/level_set.hpp"
#include "surface/marching_cubes.hpp"
#include "surface/set_surface.hpp"

namespace qjulia {
namespace {

constexpr int kMostCells = 8192;
/// F_1 is smooth and is interpolated as it is. Further iterates jump where orbits part; a
/// difference that an image radius e² times the level's makes is as good as any larger one.
constexpr double kReach = 2;
/// The shape's box is widened by this on each side to begin with.
constexpr double kMargin = 0.05;

bool is_box(const Box& box) {
  return box.low.allFinite() && box.high.allFinite() && (box.size().array() > 0).all();
}

/// No point of the set is farther from the origin, map units.
double farthest_inside(const StopRadii& stops) {
  return std::isfinite(stops.outer) && stops.outer > 0 ? stops.outer : stops.escape;
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

TriangleMesh march(const LevelSet& set, double level, double reach, const Grid& grid,
                   const Watch& watch) {
  const auto [nx, ny, nz] = grid.points;
  const auto slice = static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny);
  const int at_once = slices_at_once(grid);
  MarchingCubes cubes(nx, ny, level, reach);
  const auto start = std::chrono::steady_clock::now();
  for (int z = 0; z < nz; z += at_once) {
    if (watch.stop.stop_requested()) throw Interrupted();
    const int count = std::min(at_once, nz - z);
    const auto values = set.over(grid, slices(grid, z, count));
    for (std::size_t first = 0; first < values.size(); first += slice) {
      cubes.add(std::span(values).subspan(first, slice));
    }
    const double done = static_cast<double>(z + count) / nz;
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
    watch.report({"extracting the surface", done, taken.count() * (1 - done) / done,
                  fmt::format("{} triangles", cubes.triangle_count())});
  }
  return cubes.take();
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
  if (box && !is_box(*box)) {
    throw InputError("--box is not a box; give x0 y0 z0 x1 y1 z1 with x0 < x1, y0 < y1, z0 < z1");
  }
}

TriangleMesh set_surface(const Device& device, const RationalMap& map, const StopRadii& stops,
                         const SurfaceOptions& options, const Watch& watch) {
  const LevelSet set(device, map, stops, options.iterations);
  Box box;
  if (options.box) {
    box = {map.shape_to_map.to_map(options.box->low), map.shape_to_map.to_map(options.box->high)};
  } else {
    box = grown_clear(set, map.surface_level, starting_box(set, map, stops), options.resolution,
                      2 * farthest_inside(stops), watch);
  }
  const Grid grid = grid_over(box, options.resolution);
  const double reach = options.iterations == 1 ? std::numeric_limits<double>::infinity() : kReach;
  TriangleMesh mesh = march(set, map.surface_level, reach, grid, watch);
  for (Eigen::Vector3d& vertex : mesh.vertices) {
    vertex = map.shape_to_map.to_shape(grid.at(vertex));
  }
  return mesh;
}

TriangleMesh extract_surface(const Device& device, const RationalMap& map,
                             const SurfaceOptions& options, const Watch& watch) {
  options.validate();
  map.validate();
  return set_surface(device, map, find_stop_radii(device, map), options, watch);
}

}  // namespace qjulia
