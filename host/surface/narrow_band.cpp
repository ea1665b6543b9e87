#include "surface/narrow_band.hpp"

#include <algorithm>
#include <cmath>

namespace qjulia::surface {
namespace {

/// Points along the sides of the smallest blocks. Smaller ones would save few potentials, which are
/// cheap, and cost as many bounds: 8 takes a sixth longer where the shell is thin.
constexpr int kLeaf = 4;

int blocks_over(int points, int size) { return (points + size - 1) / size; }

}  // namespace

/// The blocks of `size` points a side that cover kSlices slices, x fastest.
struct NarrowBand::Blocks {
  int size;
  std::array<int, 3> count;
  std::vector<Side> sides;

  Blocks(const Grid& grid, int size_)
      : size(size_),
        count{blocks_over(grid.points[0], size), blocks_over(grid.points[1], size), kSlices / size},
        sides(static_cast<std::size_t>(count[0]) * static_cast<std::size_t>(count[1]) *
                  static_cast<std::size_t>(count[2]),
              Side::unknown) {}

  Side& at(int x, int y, int z) {
    const int block = (z * count[1] + y) * count[0] + x;
    return sides[static_cast<std::size_t>(block)];
  }
  Side at(int x, int y, int z) const { return const_cast<Blocks*>(this)->at(x, y, z); }
};

Slab unclassified_slab(const Grid& grid, int slices) {
  return {slices, grid.points[1], {{{0, grid.points[0], Side::unknown}}}};
}

NarrowBand::NarrowBand(const LevelSet& set, const Grid& grid, double level)
    : set_(set),
      grid_(grid),
      inside_below_(set.certainly_inside_below(level)),
      outside_above_(set.certainly_outside_above(level)) {
  const Eigen::Vector3d last =
      grid.at(Eigen::Vector3d(grid.points[0], grid.points[1], grid.points[2]));
  rounding_ = 0x1p-21 * grid.origin.cwiseAbs().cwiseMax(last.cwiseAbs()).maxCoeff();
}

void NarrowBand::classify(Blocks& blocks, int z) const {
  PointList centers;
  std::vector<std::size_t> numbers;
  const double middle = 0.5 * (blocks.size - 1);
  std::size_t number = 0;
  for (int bz = 0; bz < blocks.count[2]; ++bz) {
    const int first_slice = z + bz * blocks.size;
    for (int by = 0; by < blocks.count[1]; ++by) {
      for (int bx = 0; bx < blocks.count[0]; ++bx, ++number) {
        if (blocks.sides[number] != Side::unknown || first_slice >= grid_.points[2]) continue;
        const Eigen::Vector3d center = grid_.at(Eigen::Vector3d(
            bx * blocks.size + middle, by * blocks.size + middle, first_slice + middle));
        centers.add(center.x(), center.y(), center.z());
        numbers.push_back(number);
      }
    }
  }
  const double half_side = 0.5 * grid_.step * (blocks.size + 1) + rounding_;
  const FieldBounds bounds = set_.bounds(centers, half_side);
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (bounds.high[i] < inside_below_) blocks.sides[numbers[i]] = Side::inside;
    if (bounds.low[i] > outside_above_) blocks.sides[numbers[i]] = Side::outside;
  }
}

Slab NarrowBand::slab_of(const Blocks& blocks, int block_z, int slices) const {
  Slab slab{slices, blocks.size, {}};
  for (int by = 0; by < blocks.count[1]; ++by) {
    std::vector<PointRun> row;
    for (int bx = 0; bx < blocks.count[0]; ++bx) {
      const int end = std::min((bx + 1) * blocks.size, grid_.points[0]);
      const Side side = blocks.at(bx, by, block_z);
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

std::vector<Slab> NarrowBand::slabs(int z) const {
  Blocks blocks(grid_, kSlices);
  classify(blocks, z);
  while (blocks.size > kLeaf) {
    Blocks halves(grid_, blocks.size / 2);
    for (int bz = 0; bz < halves.count[2]; ++bz) {
      for (int by = 0; by < halves.count[1]; ++by) {
        for (int bx = 0; bx < halves.count[0]; ++bx) {
          halves.at(bx, by, bz) = blocks.at(bx / 2, by / 2, bz / 2);
        }
      }
    }
    blocks = std::move(halves);
    classify(blocks, z);
  }
  std::vector<Slab> slabs;
  for (int bz = 0; bz < blocks.count[2]; ++bz) {
    const int slices = std::min(blocks.size, grid_.points[2] - z - bz * blocks.size);
    if (slices > 0) slabs.push_back(slab_of(blocks, bz, slices));
  }
  return slabs;
}

}  // namespace qjulia::surface
