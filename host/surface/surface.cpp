#include "qjulia/surface/surface.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <deque>
#include <functional>
#include <future>
#include <limits>
#include <nlohmann/json.hpp>
#include <numeric>
#include <utility>

#include "base/random.hpp"
#include "device/point_batch.hpp"
#include "lattice/clear_box.hpp"
#include "lattice/level_set.hpp"
#include "lattice/orbit_lookup.hpp"
#include "map/checks.hpp"
#include "map/portals.hpp"
#include "qjulia/map/field.hpp"
#include "qjulia/surface/surface_settings.hpp"
#include "surface/marching_cubes.hpp"
#include "surface/narrow_band.hpp"
#include "surface/vertex_placer.hpp"

namespace qjulia {

using namespace surface;
namespace {

/// Tries for each vertex where n > 1, so that F_n jumps. At 320 cells, 1.3 % of a skull's area and
/// 0.8 % of a bunny's are within 3° of facing an axis; 12 and 23 % without tries, 1.1 and 0.9 %
/// with six.
constexpr int kTries = 2;
/// Vertices are placed when at least so many wait, so that a launch keeps a GPU busy.
constexpr std::size_t kPlacedAtOnce = std::size_t{1} << 15;
/// F_1 is smooth and is interpolated as it is. Further iterates jump where orbits part: there a
/// difference from the level is as good as any larger one when orbits that far off have ended, at
/// r_in or r_out. Larger ones put vertices farther from bisected ones (with 2 they are a fifth
/// farther off; bunny, n = 6, 384 cells); less than a quarter flattens where iterates are smooth.
constexpr double kLeastReach = 0.25, kMostReach = 1;
/// The most that looked-up orbits may displace the surface, in cells.
constexpr double kDisplacement = 0.25;
/// The box of shape and copies is widened by this on each side to begin with.
constexpr double kMargin = 0.05;

/// No point of the set is farther from the origin, map units.
double farthest_inside(const StopRadii& stops) {
  return std::isfinite(stops.outer) && stops.outer > 0 ? stops.outer : stops.escape;
}

/// Differences from the level are clamped to it, those above it after division by the steepness.
double reach_about(double level, double steepness, const StopRadii& stops, int iterations) {
  if (iterations == 1) return std::numeric_limits<double>::infinity();
  const double nearer =
      std::min(level - std::log(stops.inner), (std::log(stops.outer) - level) / steepness);
  return std::clamp(nearer, kLeastReach, kMostReach);
}

GridField field_of(const LevelSet& set) {
  return [&set](const Grid& grid, const GridBlock& block) { return set.over(grid, block); };
}

/// A box that most of the set lies in; map units.
Box box_about(const LevelSet& set, const Map& map, const StopRadii& stops) {
  const ShapeToMap& to_map = map.frame.shape_to_map;
  if (const std::optional<Box> known = map::box_with_copies(map)) {
    const Eigen::Vector3d margin = Eigen::Vector3d::Constant(kMargin * known->size().maxCoeff());
    return {to_map.to_map(known->low - margin), to_map.to_map(known->high + margin)};
  }
  return shrunk_to_inside(field_of(set), map.dynamics.surface_level, cube(farthest_inside(stops)));
}

/// The box asked for, or one that is clear of the set; map units.
Box box_to_mesh(const LevelSet& set, const Map& map, const StopRadii& stops,
                const SurfaceOptions& options, const ProgressMonitor& monitor) {
  if (options.box) return map.frame.shape_to_map.to_map(*options.box);
  return enlarged_until_clear(field_of(set), map.dynamics.surface_level, box_about(set, map, stops),
                              options.resolution, 2 * farthest_inside(stops), monitor);
}

/// Points of the slab whose sides are unknown, numbered in its slices, x fastest, then y.
std::vector<std::int32_t> unknown_points(const Grid& grid, const Slab& slab) {
  std::vector<std::int32_t> numbers;
  for (int k = 0; k < slab.slices; ++k) {
    const std::size_t before = slices(grid, 0, k).size();
    each_unknown(slab, grid.points, [&](std::size_t first, std::size_t count) {
      const auto known = static_cast<std::ptrdiff_t>(numbers.size());
      numbers.resize(numbers.size() + count);
      // A grid block has fewer than 2³¹ points.
      std::iota(numbers.begin() + known, numbers.end(), device::narrow(before + first));
    });
  }
  return numbers;
}

/// From slabs to triangles, on a thread of its own: one slab is meshed while the next is evaluated.
class Mesher {
 public:
  /// @param placer of vertices, on a device of its own; without one (null) they stay where the
  ///   field's interpolated difference vanishes.
  Mesher(const Grid& grid, const Map& map, const DifferenceScale& scale, const VertexPlacer* placer,
         SurfaceSink& sink)
      : grid_(grid),
        placer_(placer),
        cubes_(grid.points, map.dynamics.surface_level, scale),
        builder_(grid, map.frame.shape_to_map, sink) {}

  /// Meshes the next slab, after the one before is done; takes `values` and leaves a buffer of
  /// unspecified values. @throws what meshing the slab before threw.
  void add(const Slab& slab, std::vector<float>& values) {
    wait();
    std::swap(values_, values);
    slabs_.push_back(slab);
    // The first slice of a slab is joined to the last one of the slab before.
    if (slabs_.size() > 2) slabs_.pop_front();
    meshing_ = std::async(std::launch::async, [this] { return mesh(); });
  }

  /// Until all slabs are meshed.
  void wait() {
    if (meshing_.valid()) counts_ = meshing_.get();
  }

  /// Vertices, triangles and open edges of the slabs that were waited for.
  const SurfaceReport& counts() const { return counts_; }

 private:
  SurfaceReport mesh() {
    const Slab& slab = slabs_.back();
    const std::size_t slice = slices(grid_, 0, 1).size();
    for (int k = 0; k < slab.slices; ++k) {
      cubes_.add(std::span(values_).subspan(static_cast<std::size_t>(k) * slice, slice), slab);
    }
    meshed_ += slab.slices;
    if (cubes_.waiting() >= kPlacedAtOnce || meshed_ == grid_.points.z()) {
      MeshPart part = cubes_.take();
      if (placer_ != nullptr) placer_->place(grid_, part.vertices);
      builder_.add(part);
      open_edges_ += part.open_edges;
    }
    return {builder_.vertices(), builder_.triangles(), open_edges_};
  }

  Grid grid_;
  const VertexPlacer* placer_;
  MarchingCubes cubes_;
  MeshBuilder builder_;
  int meshed_ = 0;  ///< slices
  std::size_t open_edges_ = 0;
  SurfaceReport counts_;
  std::vector<float> values_;
  std::deque<Slab> slabs_;
  std::future<SurfaceReport> meshing_;  ///< last: it ends before what it works on
};

/// A slab whose values are being evaluated.
struct SlabEvaluation {
  Slab slab;
  std::future<std::vector<float>> values;
};

/// Marching cubes of {F_n = level} over the grid, slab by slab.
/// @param set, second the same set on a device and on its sibling: two slabs are evaluated at a
///   time, so that the device is busy while the host looks through what came back.
/// @return vertices, triangles and open edges.
SurfaceReport mesh_level_set(const LevelSet& set, const LevelSet& second, double level,
                             const DifferenceScale& scale, const Grid& grid, bool dense,
                             Mesher& mesher, const ProgressMonitor& monitor) {
  const int slices = grid.points[2];
  const auto evaluate = [&](const LevelSet& on, const Slab& slab, int z,
                            std::vector<float> values) {
    const GridBlock block = surface::slices(grid, z, slab.slices);
    if (dense) return on.densely_over(grid, block, level);
    values.resize(block.size());
    on.clamped_at(grid, block, unknown_points(grid, slab),
                  {level, scale.reach, scale.steepness * scale.reach}, values);
    return values;
  };
  const auto start = std::chrono::steady_clock::now();
  std::deque<SlabEvaluation> under_way;
  std::vector<float> spare;  // the next slab's values: clearing new memory takes time
  int meshed = 0;
  const auto mesh_first = [&] {
    {
      const TraceStage stage(monitor.trace, "wait for values");
      spare = under_way.front().values.get();
    }
    {
      const TraceStage stage(monitor.trace, "wait for triangles");
      mesher.add(under_way.front().slab, spare);
    }
    meshed += under_way.front().slab.slices;
    under_way.pop_front();
    const double fraction = static_cast<double>(meshed) / slices;
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
    monitor.report({"extracting the surface", fraction, taken.count() * (1 - fraction) / fraction,
                    fmt::format("{} triangles", mesher.counts().triangles)});
  };
  bool on_second = false;
  for (int z = 0; z < slices;) {
    // Blocks are bounded on the first queue, so no slab may be evaluated at the same time.
    while (!under_way.empty()) mesh_first();
    const std::vector<Slab> slabs = [&] {
      const TraceStage stage(monitor.trace, "bound blocks");
      return dense
                 ? std::vector{unclassified_slab(grid, std::min(slices_at_once(grid), slices - z))}
                 : narrow_band(set, grid, level, z);
    }();
    for (const Slab& slab : slabs) {
      throw_if_stopped(monitor.stop);
      if (under_way.size() == 2) mesh_first();
      const LevelSet& on = on_second ? second : set;
      under_way.push_back({slab, std::async(std::launch::async, evaluate, std::cref(on), slab, z,
                                            std::exchange(spare, {}))});
      on_second = !on_second;
      z += slab.slices;
    }
  }
  while (!under_way.empty()) mesh_first();
  const TraceStage stage(monitor.trace, "wait for triangles");
  mesher.wait();
  return mesher.counts();
}

}  // namespace

void SurfaceOptions::validate() const {
  expect_in_ranges(surface_settings(), *this);
  map::expect_box(box);
}

SurfaceReport surface::level_set_surface(const Device& device, const Map& map,
                                         const StopRadii& stops, const SurfaceOptions& options,
                                         SurfaceSink& sink, const ProgressMonitor& monitor,
                                         TableUse tables) {
  LevelSet set(device, map, stops, options.iterations, options.precision);
  const double level = map.dynamics.surface_level;
  const Box box = [&] {
    const TraceStage stage(monitor.trace, "find the box");
    return box_to_mesh(set, map, stops, options, monitor);
  }();
  const Grid grid = grid_over(box, options.resolution);
  const DifferenceScale scale{reach_about(level, map.layers.steepness, stops, options.iterations),
                              map.layers.steepness};
  std::shared_ptr<const OrbitLookup> lookup;
  const bool may_look_up = !options.exact && !options.dense && options.iterations > 1;
  if (may_look_up && (tables == TableUse::always || tables_pay(map, grid))) {
    const TraceStage stage(monitor.trace, "tables of images");
    lookup = make_lookup({device, map, stops, options.precision}, set, level, grid,
                         kDisplacement * grid.step, monitor.stop);
    device.context().finish();  // they are used in other queues too
  }
  const Device sibling = device.sibling();
  LevelSet second(sibling, map, stops, options.iterations, options.precision);
  const int tries = options.refine.value_or(options.iterations > 1 ? kTries : 0);
  std::optional<Device> placing;
  std::optional<VertexPlacer> placer;
  if (tries > 0) {
    placing = device.sibling(Trace::Row::third_queue);
    placer.emplace(*placing, map, stops, options.iterations, options.precision, scale, tries);
  }
  set.reset_counts();
  set.look_up(lookup);
  second.look_up(lookup);
  const TraceStage stage(monitor.trace, "extract the surface");
  Mesher mesher(grid, map, scale, placer ? &*placer : nullptr, sink);
  SurfaceReport report =
      mesh_level_set(set, second, level, scale, grid, options.dense, mesher, monitor);
  sibling.record(nullptr);
  if (placing) placing->record(nullptr);
  report.grid_points = whole(grid).size();
  if (lookup) {
    report.nodes = lookup->lattice.nodes();
    report.trusted_share = lookup->lattice.trusted_share();
  }
  for (const SurfaceReport& counts : {set.counts(), second.counts()}) {
    report.potentials += counts.potentials;
    report.settled += counts.settled;
    report.nodes += counts.nodes;
    report.iterated += counts.iterated;
    report.iterates += counts.iterates;
    report.bounded_blocks += counts.bounded_blocks;
  }
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

SurfaceReport extract_surface(const Device& device, const Map& map, const SurfaceOptions& options,
                              SurfaceSink& sink, const ProgressMonitor& monitor) {
  options.validate();
  map.validate();
  const StopRadii stops = [&] {
    const TraceStage stage(monitor.trace, "stop radii");
    return find_stop_radii(device, map, options.escape, monitor.stop);
  }();
  return level_set_surface(device, map, stops, options, sink, monitor);
}

TriangleMesh extract_surface(const Device& device, const Map& map, const SurfaceOptions& options,
                             const ProgressMonitor& monitor) {
  MeshSink sink;
  extract_surface(device, map, options, sink, monitor);
  return std::move(sink.mesh);
}

bool has_points(const Device& device, const Map& map, const SurfaceOptions& options,
                const std::stop_token& stop) {
  options.validate();
  map.validate();
  constexpr std::size_t kPlaces = std::size_t{1} << 16;
  constexpr std::uint64_t kSeed = 1;
  const StopRadii stops = find_stop_radii(device, map, options.escape, stop);
  const LevelSet set(device, map, stops, options.iterations, options.precision);
  const Box box =
      options.box ? map.frame.shape_to_map.to_map(*options.box) : box_about(set, map, stops);
  std::vector<Eigen::Vector3d> places;
  places.reserve(kPlaces + 1);
  if (Eigen::AlignedBox3d(box.low, box.high).contains(Eigen::Vector3d::Zero().eval())) {
    places.emplace_back(Eigen::Vector3d::Zero());
  }
  base::Random random(kSeed);
  for (std::size_t i = 0; i < kPlaces; ++i) {
    Eigen::Vector3d x;
    for (int axis = 0; axis < 3; ++axis) x[axis] = random.uniform(box.low[axis], box.high[axis]);
    places.push_back(x);
  }
  const auto level = static_cast<float>(map.dynamics.surface_level);
  return std::ranges::any_of(set.at(places), [&](float value) { return value < level; });
}

nlohmann::json to_json(const SurfaceReport& report) {
  return {{"grid", report.grid_points},
          {"potentials", report.potentials},
          {"settled", report.settled},
          {"nodes", report.nodes},
          {"iterated", report.iterated},
          {"iterates", report.iterates},
          {"bounded_blocks", report.bounded_blocks},
          {"trusted_share", report.trusted_share}};
}

}  // namespace qjulia
