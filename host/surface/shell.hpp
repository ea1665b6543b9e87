#pragma once
/// Where on a grid F_1 alone says on which side of the surface a point is, and where it does not.

#include <cstdint>
#include <vector>

#include "surface/level_set.hpp"

namespace qjulia {

enum class Side : std::uint8_t { inside, outside, unknown };

/// Points begin … end − 1 along x.
struct Run {
  int begin = 0;
  int end = 0;
  Side side = Side::unknown;
};

/// Several slices cut into blocks; all points of a block are on one known side, or unknown.
struct Layer {
  int slices = 0;
  int block = 0;                       ///< points along a block's side
  std::vector<std::vector<Run>> rows;  ///< of row y / block, covering it

  const std::vector<Run>& row(int y) const { return rows[static_cast<std::size_t>(y / block)]; }
};

/// `slices` slices of which nothing is known.
Layer unknown_layer(const Grid& grid, int slices);

/// Halves blocks until bounds of F_1 put them on one side of the surface for certain. A block's
/// bounds hold one step beyond its points too: no cell with a point of known side is crossed by the
/// surface, so that no field value is missed there.
class Shell {
 public:
  /// Slices that are looked at together.
  static constexpr int kSlices = 64;

  Shell(const LevelSet& set, const Grid& grid, double level);

  /// The layers of slices z … z + kSlices − 1, as far as the grid has them, rising z.
  std::vector<Layer> layers(int z) const;

 private:
  struct Blocks;
  void classify(Blocks& blocks, int z) const;
  Layer layer_of(const Blocks& blocks, int block_z, int slices) const;

  const LevelSet& set_;
  Grid grid_;
  double inside_below_, outside_above_;
  double rounding_;  ///< of coordinates
};

}  // namespace qjulia
