#pragma once
/// Regular grids of points, and blocks of them.

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <utility>

namespace qjulia::surface {

/// Point (i, j, k) lies at origin + step (i, j, k), map coordinates.
struct Grid {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  double step = 1;
  std::array<int, 3> points{0, 0, 0};

  Eigen::Vector3d at(const Eigen::Vector3d& index) const { return origin + step * index; }
};

/// The points first … first + count − 1 of a grid along each axis. Fewer than 2³¹ of them.
struct GridBlock {
  std::array<int, 3> first{0, 0, 0};
  std::array<int, 3> count{0, 0, 0};

  std::size_t size() const {
    std::size_t points = 1;
    for (const int n : count) points *= static_cast<std::size_t>(n);
    return points;
  }
};

inline GridBlock whole(const Grid& grid) { return {{0, 0, 0}, grid.points}; }

/// The grid's slices `z` … `z + count − 1`.
inline GridBlock slices(const Grid& grid, int z, int count) {
  return {{0, 0, z}, {grid.points[0], grid.points[1], count}};
}

/// Slices to evaluate at a time: about a million points, which bounds memory.
inline int slices_at_once(const Grid& grid) {
  constexpr std::size_t kPoints = std::size_t{1} << 20;
  return static_cast<int>(std::max<std::size_t>(1, kPoints / slices(grid, 0, 1).size()));
}

/// The least and greatest indices of the points that are marked, along each axis; nothing when none
/// is. @param is_marked called with a point's number, x fastest.
template <class Predicate>
std::optional<std::pair<Eigen::Vector3i, Eigen::Vector3i>> marked_indices(const Grid& grid,
                                                                          Predicate is_marked) {
  Eigen::Vector3i low(grid.points[0], grid.points[1], grid.points[2]);
  Eigen::Vector3i high(-1, -1, -1);
  std::size_t number = 0;
  for (int k = 0; k < grid.points[2]; ++k) {
    for (int j = 0; j < grid.points[1]; ++j) {
      for (int i = 0; i < grid.points[0]; ++i, ++number) {
        if (!is_marked(number)) continue;
        low = low.cwiseMin(Eigen::Vector3i(i, j, k));
        high = high.cwiseMax(Eigen::Vector3i(i, j, k));
      }
    }
  }
  if (high.x() < 0) return std::nullopt;
  return std::pair{low, high};
}

}  // namespace qjulia::surface
