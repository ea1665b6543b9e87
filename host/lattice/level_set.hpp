#pragma once
/// F_n at the points of a regular grid, block by block, and its level set as a mesh.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "lattice/grid.hpp"
#include "map/device_map.hpp"
#include "qjulia/map/field.hpp"
#include "qjulia/surface/surface.hpp"

namespace qjulia::surface {

struct OrbitLookup;

/// A launch's arguments.
using Arguments = std::vector<device::Argument>;

/// Least and greatest F_1, or where that decides nothing F_2, for each of several cubes.
struct FieldBounds {
  std::vector<float> low, high;
};

/// Values farther than `below` under `level` or `above` over it are as good as any of that side.
struct ClampRange {
  double level = 0;
  double below = 0;
  double above = 0;
};

/// F_n with orbits ended at the stop radii; orbits run in the precision given, and values are
/// rounded to single. They are those of `Field::decided_at`, bit for bit: one iterate everywhere,
/// and further ones only at the points that are still undecided, gathered anew after each so that
/// no lane is idle. Points stay on the device; what passes to and fro are numbers and F.
class LevelSet {
 public:
  LevelSet(const Device& device, const Map& map, const StopRadii& stops, int iterations,
           Precision precision = Precision::single);

  Precision precision() const { return map_.precision(); }

  /// Sparse values are looked up from now on, where they can be. @param lookup null: no longer.
  void look_up(std::shared_ptr<const OrbitLookup> lookup) { lookup_ = std::move(lookup); }

  /// One value a point, x fastest, then y. Launches are kept near 100 ms.
  std::vector<float> over(const Grid& grid, const GridBlock& block) const;

  /// The same for the surface at `level`, where every orbit runs until it escapes or n iterates are
  /// done: what `over` and the stop radii are checked against. An orbit that ends on another side
  /// than the one it was stopped on has the value it ends with.
  std::vector<float> densely_over(const Grid& grid, const GridBlock& block, double level) const;

  /// F_n at the block's points of these numbers (x fastest, then y), at the same places of
  /// `values`.
  void at(const Grid& grid, const GridBlock& block, std::span<const std::int32_t> numbers,
          std::span<float> values) const;

  /// The same for use clamped: where F_n is farther than `reach` from `level` it may be any number
  /// that is, on the same side. Most points that one iterate or two decide are settled by
  /// `settle_by_interpolation`, at a fraction of the cost; after `look_up`, most points are looked
  /// up instead.
  void clamped_at(const Grid& grid, const GridBlock& block, std::span<const std::int32_t> numbers,
                  const ClampRange& clamp, std::span<float> values) const;

  /// F_n at points anywhere on the slice, map coordinates.
  std::vector<float> at(std::span<const Eigen::Vector3d> points) const;

  /// Bounds of F_1 over cubes that reach `half_side` from their centres along each axis; of
  /// ln |q| where they reach beyond the escape radius; of F_2 where a portal leads to an image that
  /// goes on. Rounding is allowed for.
  FieldBounds bounds(std::span<const Eigen::Vector3d> centers, double half_side) const;

  /// Where F_1 is below it, F_n is certainly below `level`; −infinity if no such bound is known.
  double certainly_inside_below(double level) const;
  /// Where F_1 is above it, F_n is certainly above `level`.
  double certainly_outside_above(double level) const;

  /// How many points were asked for what: potentials … bounded_blocks.
  const SurfaceReport& counts() const { return counts_; }
  void reset_counts() { counts_ = {}; }

 private:
  /// F_n of `count` points, chunk by chunk: `start(begin, count, orbits)` launches
  /// `first_kernel`, the first iterate of some, `take(begin, values)` gets what they end with.
  template <class Start, class Take>
  void iterate(std::size_t count, const device::Kernel& first_kernel, const Start& start,
               const Take& take) const {
    precision() == Precision::dbl ? iterate_in<double>(count, first_kernel, start, take)
                                  : iterate_in<float>(count, first_kernel, start, take);
  }
  template <class Real, class Start, class Take>
  void iterate_in(std::size_t count, const device::Kernel& first_kernel, const Start& start,
                  const Take& take) const;
  /// What the first iterates of so many work-items cost.
  double work(std::size_t groups) const {
    return static_cast<double>(groups) * map_.points_per_item() * map_.modulus_cost();
  }

  /// Gives take(i, F_n) those of `count` points whose orbits can be looked up from their start on.
  /// @param point (i) → map coordinates. @return the numbers i of the others.
  template <class At, class Take>
  std::vector<std::size_t> looked_up(std::size_t count, const At& point, const Take& take) const;
  /// F_n at points whose first iterates are computed.
  std::vector<float> iterated_at(std::span<const Eigen::Vector3d> points) const;
  template <class Real>
  bool undecided(Real value) const {
    return value > below_ && value < above_;
  }
  device::Kernel kernel(const char* name) const { return map_.kernel("level_set.cl", name); }

  map::DeviceMap map_;
  int iterations_;
  float below_;  ///< an iterate of this log radius or less never leaves
  float above_;  ///< an iterate of this log radius or more never returns
  mutable SurfaceReport counts_;
  std::shared_ptr<const OrbitLookup> lookup_;
};

/// Whether a surface takes tables where these save time, or however small its grid is.
enum class TableUse { where_they_pay, always };

/// `extract_surface` for callers that know the stop radii. Map and options are valid.
SurfaceReport level_set_surface(const Device& device, const Map& map, const StopRadii& stops,
                                const SurfaceOptions& options, SurfaceSink& sink,
                                const ProgressMonitor& monitor,
                                TableUse tables = TableUse::where_they_pay);

}  // namespace qjulia::surface
