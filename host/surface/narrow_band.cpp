#include "surface/narrow_band.hpp"

#include <algorithm>

namespace qjulia::surface {
namespace {

/// Points along the sides of the smallest blocks. Smaller ones would save few potentials, which are
/// cheap, and cost as many bounds: 8 takes a sixth longer where the shell is thin.
constexpr int kLeaf = 4;
/// Slices that are classified together.
constexpr int kSlices = 64;

/// The blocks of `size` points a side that cover kSlices slices, x fastest.
struct Blocks {
  int size;
  Eigen::Vector3i count;
  std::vector<Side> sides;

  Blocks(const Grid& grid, int size_)
      : size(size_),
        count((grid.points[0] + size - 1) / size, (grid.points[1] + size - 1) / size,
              kSlices / size),
        sides(GridBlock{{}, count}.size(), Side::unknown) {}
};

/// Finds the sides of blocks, the first of which begins with slice z, where they are unknown.
void classify(const LevelSet& set, const Grid& grid, double level, int z, Blocks& blocks) {
  std::vector<Eigen::Vector3d> centers;
  std::vector<std::size_t> numbers;
  for_points(blocks.count, [&](std::size_t number, const Eigen::Vector3i& block) {
    const Eigen::Vector3i first = blocks.size * block + Eigen::Vector3i(0, 0, z);
    if (blocks.sides[number] != Side::unknown || first.z() >= grid.points.z()) return;
    centers.push_back(grid.at(first.cast<double>().array() + 0.5 * (blocks.size - 1)));
    numbers.push_back(number);
  });
  const Eigen::Vector3d last = grid.point(grid.points);
  const double rounding = 0x1p-21 * grid.origin.cwiseAbs().cwiseMax(last.cwiseAbs()).maxCoeff();
  const FieldBounds bounds = set.bounds(centers, 0.5 * grid.step * (blocks.size + 1) + rounding);
  const double inside_below = set.certainly_inside_below(level);
  const double outside_above = set.certainly_outside_above(level);
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (bounds.high[i] < inside_below) blocks.sides[numbers[i]] = Side::inside;
    if (bounds.low[i] > outside_above) blocks.sides[numbers[i]] = Side::outside;
  }
}

/// Slices of the blocks that are `block_z`-th along z.
Slab slab_of(const Grid& grid, const Blocks& blocks, int block_z, int slices) {
  Slab slab{slices, blocks.size, {}};
  for (int by = 0; by < blocks.count[1]; ++by) {
    std::vector<PointRun> row;
    for (int bx = 0; bx < blocks.count[0]; ++bx) {
      const int end = std::min((bx + 1) * blocks.size, grid.points[0]);
      const Side side = blocks.sides[number_of({bx, by, block_z}, blocks.count)];
      if (!row.empty() && row.back().side == side) {
        row.back().end = end;
      } else {
        row.push_back({bx * blocks.size, end, side});
      }
    }
    slab.rows.push_back(std::move(row));
  }
  return slab;
}

}  // namespace

Slab unclassified_slab(const Grid& grid, int slices) {
  return {slices, grid.points[1], {{{0, grid.points[0], Side::unknown}}}};
}

std::vector<Slab> narrow_band(const LevelSet& set, const Grid& grid, double level, int z) {
  Blocks blocks(grid, kSlices);
  classify(set, grid, level, z, blocks);
  while (blocks.size > kLeaf) {
    Blocks halves(grid, blocks.size / 2);
    for_points(halves.count, [&](std::size_t number, const Eigen::Vector3i& half) {
      halves.sides[number] = blocks.sides[number_of(half / 2, blocks.count)];
    });
    blocks = std::move(halves);
    classify(set, grid, level, z, blocks);
  }
  std::vector<Slab> slabs;
  for (int bz = 0; bz < blocks.count[2]; ++bz) {
    const int slices = std::min(blocks.size, grid.points[2] - z - bz * blocks.size);
    if (slices > 0) slabs.push_back(slab_of(grid, blocks, bz, slices));
  }
  return slabs;
}

}  // namespace qjulia::surface
