#pragma once
/// The signed distance to a shape on a regular grid, as coefficients of a spline.

#include <array>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <vector>

namespace qjulia {

/// What a grid holds: whole numbers, so that files give back every bit.
///
/// Lengths are in cells, and cell (0, 0, 0) begins at the origin. The distance is the sum of two
/// triquadratic B-splines, C¹: one whose coefficients belong to the centres of coarse cells, four
/// cells wide, everywhere; and one whose coefficients belong to the centres of cells, in those
/// coarse cells alone that lie near the surface: what the coarse one misses. It is evaluated at
/// least one coarse cell away from the grid's faces.
struct DistanceGridData {
  static constexpr int kCoarse = 4;                     ///< cells along a coarse cell
  static constexpr std::size_t kBlock = 64;             ///< cells of a coarse cell
  static constexpr double kCoarseUnit = 1.0 / 64;       ///< cells, of a coarse coefficient
  static constexpr double kCorrectionUnit = 1.0 / 256;  ///< cells, of a correction

  std::array<int, 3> cells{};             ///< multiples of 4
  std::vector<std::int16_t> coarse;       ///< one a coarse cell, x fastest
  std::vector<std::uint32_t> blocks;      ///< numbers of coarse cells with corrections, rising
  std::vector<std::int16_t> corrections;  ///< 64 for each of these, x fastest

  bool operator==(const DistanceGridData&) const = default;

  std::array<int, 3> coarse_cells() const {
    return {cells[0] / kCoarse, cells[1] / kCoarse, cells[2] / kCoarse};
  }
  /// Numbers of cells and of coarse cells.
  std::size_t size() const;
  std::size_t coarse_size() const;
};

/// A grid that is whole, and what is computed from it. Shared, not changed.
class DistanceGrid {
 public:
  static constexpr int kFewestCells = 16, kMostCells = 512;  ///< along a side
  static constexpr std::size_t kMostInAll = std::size_t{1} << 26U;

  /// @throws InputError when sizes are out of range or do not match, blocks do not rise, or the
  ///   surface is not clear of the outermost cells.
  explicit DistanceGrid(DistanceGridData data);

  const DistanceGridData& data() const { return data_; }
  /// Coefficients of both splines together, for every cell, x fastest; made when they are first
  /// asked for.
  const std::vector<float>& coefficients() const;
  /// The distance changes by at most so much a cell.
  double slope() const;
  /// Cells: how far from `center` (in cells) the inside can reach.
  double farthest_inside(const std::array<double, 3>& center) const;

 private:
  void expand() const;

  DistanceGridData data_;
  mutable std::once_flag once_;  ///< guards the two members below
  mutable std::vector<float> coefficients_;
  mutable double slope_ = 0;
};

}  // namespace qjulia
