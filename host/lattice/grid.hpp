#pragma once
/// Regular grids of points, and blocks of them.

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

#include "qjulia/base/box.hpp"

namespace qjulia::surface {

/// Point (i, j, k) lies at origin + step (i, j, k), map coordinates.
struct Grid {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  double step = 1;
  Eigen::Vector3i points = Eigen::Vector3i::Zero();

  Eigen::Vector3d at(const Eigen::Vector3d& index) const { return origin + step * index; }
  Eigen::Vector3d point(const Eigen::Vector3i& index) const { return at(index.cast<double>()); }
};

/// The points first … first + count − 1 of a grid along each axis. Fewer than 2³¹ of them.
struct GridBlock {
  Eigen::Vector3i first = Eigen::Vector3i::Zero();
  Eigen::Vector3i count = Eigen::Vector3i::Zero();

  std::size_t size() const { return count.cast<std::size_t>().prod(); }
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

/// The grid that begins `margin` steps before the box's low corner and reaches at least as far
/// beyond the high one.
inline Grid grid_around(const Box& box, double step, double margin) {
  const Eigen::Array3d cells = (box.size().array() / step).ceil() + 2 * margin;
  return {box.low.array() - margin * step, step, (cells + 1).cast<int>().max(2)};
}

/// 0 … count − 1.
inline std::vector<std::int32_t> all_numbers(std::size_t count) {
  std::vector<std::int32_t> numbers(count);
  std::iota(numbers.begin(), numbers.end(), 0);
  return numbers;
}

/// Where a point stands among so many along each axis, x fastest.
inline std::size_t number_of(const Eigen::Vector3i& index, const Eigen::Vector3i& points) {
  const auto nx = static_cast<std::size_t>(points.x()), ny = static_cast<std::size_t>(points.y());
  return (static_cast<std::size_t>(index.z()) * ny + static_cast<std::size_t>(index.y())) * nx +
         static_cast<std::size_t>(index.x());
}

/// The point that stands there.
inline Eigen::Vector3i index_of(std::size_t number, const Eigen::Vector3i& points) {
  const auto nx = static_cast<std::size_t>(points.x()), ny = static_cast<std::size_t>(points.y());
  return {static_cast<int>(number % nx), static_cast<int>(number / nx % ny),
          static_cast<int>(number / nx / ny)};
}

/// Calls `visit(number, index)` for each of so many points along each axis, in their order.
template <class Visit>
void for_points(const Eigen::Vector3i& points, const Visit& visit) {
  std::size_t number = 0;
  for (int k = 0; k < points.z(); ++k) {
    for (int j = 0; j < points.y(); ++j) {
      for (int i = 0; i < points.x(); ++i) visit(number++, Eigen::Vector3i(i, j, k));
    }
  }
}

/// Visits the points at most `reach` from `middle` along each axis, `middle` included.
template <class Visit>
void for_around(const Eigen::Vector3i& points, const Eigen::Vector3i& middle, int reach,
                const Visit& visit) {
  const Eigen::Vector3i low = (middle.array() - reach).max(0);
  const Eigen::Vector3i high = (middle.array() + reach).min(points.array() - 1);
  for (int k = low.z(); k <= high.z(); ++k) {
    for (int j = low.y(); j <= high.y(); ++j) {
      for (int i = low.x(); i <= high.x(); ++i) {
        const Eigen::Vector3i index(i, j, k);
        visit(number_of(index, points), index);
      }
    }
  }
}

/// The least and greatest indices of the points that are marked, along each axis; nothing when none
/// is. @param is_marked called with a point's number.
template <class Predicate>
std::optional<std::pair<Eigen::Vector3i, Eigen::Vector3i>> marked_indices(
    const Grid& grid, const Predicate& is_marked) {
  Eigen::Vector3i low = grid.points, high = Eigen::Vector3i::Constant(-1);
  for_points(grid.points, [&](std::size_t number, const Eigen::Vector3i& index) {
    if (!is_marked(number)) return;
    low = low.cwiseMin(index);
    high = high.cwiseMax(index);
  });
  if (high.x() < 0) return std::nullopt;
  return std::pair{low, high};
}

/// The cube about the origin that reaches so far along each axis.
inline Box cube(double reach) {
  return {Eigen::Vector3d::Constant(-reach), Eigen::Vector3d::Constant(reach)};
}

}  // namespace qjulia::surface
