#pragma once
/// The band of grid points about a surface whose sides F_1 alone does not decide.

#include <cstdint>
#include <vector>

#include "lattice/level_set.hpp"

namespace qjulia::surface {

enum class Side : std::uint8_t { inside, outside, unknown };

/// Points begin … end − 1 along x, all on one side.
struct PointRun {
  int begin = 0;
  int end = 0;
  Side side = Side::unknown;
};

/// Several slices of a grid, cut into blocks: all points of a block are on one known side, or their
/// sides are unknown.
struct Slab {
  int slices = 0;
  int block = 0;                            ///< points along a block's side
  std::vector<std::vector<PointRun>> rows;  ///< runs that cover row y / block

  const std::vector<PointRun>& row(int y) const {
    return rows[static_cast<std::size_t>(y / block)];
  }
};

/// Calls f(first point's number in a slice, count) for the runs of unknown side, rising.
/// @param points of the grid.
template <class F>
void each_unknown(const Slab& slab, const Eigen::Vector3i& points, const F& f) {
  for (int y = 0; y < points.y(); ++y) {
    for (const PointRun& run : slab.row(y)) {
      if (run.side != Side::unknown) continue;
      f(number_of({run.begin, y, 0}, points), static_cast<std::size_t>(run.end - run.begin));
    }
  }
}

/// `slices` slices whose sides are all unknown.
Slab unclassified_slab(const Grid& grid, int slices);

/// Halves blocks of points until bounds of F_1 put them on one side of the surface for certain. A
/// block's bounds hold one step beyond its points too: no cell with a point of known side is
/// crossed by the surface, so none of their field values is needed.
/// @return the slabs of the 64 slices from z on, as far as the grid has them, rising z.
std::vector<Slab> narrow_band(const LevelSet& set, const Grid& grid, double level, int z);

}  // namespace qjulia::surface
