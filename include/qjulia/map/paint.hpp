#pragma once
/// How much of its detail a map has where: its surface may be wild here and smooth there.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace qjulia {

/// Where the detail is painted, F is L + (F − L) / m, with m(X, Y, Z) the share of the map's detail
/// that a place has: the shell is m times as thick. m is a triquadratic B-spline, C¹, whose
/// coefficients belong to the centres of a coarse grid's cells; it is evaluated at least 1½ cells
/// away from the grid's faces, and beyond that it is that of the nearest place.
struct Paint {
  static constexpr int kFewestCells = 4, kMostCells = 128;  ///< along a side
  static constexpr std::size_t kMostInAll = std::size_t{1} << 16U;
  static constexpr double kMargin = 1.5;  ///< cells at each end where it is not evaluated
  static constexpr int kWhole = 255;      ///< a cell with all of the detail
  static constexpr double kLeastShare = 1.0 / (kWhole + 1);

  std::array<int, 3> cells{};                        ///< numbers of cells
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< where cell (0, 0, 0) begins, map units
  double step = 0;                                   ///< side of a cell, map units
  std::vector<std::uint8_t> shares;                  ///< m = (share + 1) / 256; x fastest

  bool operator==(const Paint&) const = default;

  std::size_t size() const;  ///< number of cells
  /// m at a place, map coordinates. @throws InputError when the place is not finite or the paint is
  /// not valid.
  double at(const Eigen::Vector3d& x) const;
  /// Where a cell's centre lies, map coordinates.
  Eigen::Vector3d center(int i, int j, int k) const;
  /// @throws InputError naming what is wrong.
  void validate() const;
};

/// What a share of the detail, 0 … 1, is in a paint: the nearest it can hold, at least kLeastShare.
/// @throws InputError when it is not a number.
std::uint8_t painted_share(double share);

}  // namespace qjulia
