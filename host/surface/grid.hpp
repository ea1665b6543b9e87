#pragma once
/// Regular grids of points, and blocks of them.

#include <Eigen/Core>
#include <array>
#include <cstddef>

#include "qjulia/device.hpp"

namespace qjulia {

/// Point (i, j, k) lies at origin + step (i, j, k), map coordinates.
struct Grid {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  double step = 1;
  std::array<int, 3> points{0, 0, 0};

  Eigen::Vector3d at(const Eigen::Vector3d& index) const { return origin + step * index; }
  /// Coordinate of the points number `index` along `axis`, as kernels of this precision compute it.
  double coordinate(int axis, int index, Precision precision) const;
};

/// The points first … first + count − 1 of a grid along each axis. Fewer than 2³¹ of them.
struct GridBlock {
  std::array<int, 3> first{0, 0, 0};
  std::array<int, 3> count{0, 0, 0};

  std::size_t size() const;
};

/// The grid's slices `z` … `z + count − 1`.
GridBlock slices(const Grid& grid, int z, int count);

/// Slices to ask for at a time: about a million points, bounded memory and launches worth making.
int slices_at_once(const Grid& grid);

}  // namespace qjulia
