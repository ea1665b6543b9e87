#include "surface/limbs.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <queue>
#include <utility>

#include "base/union_find.hpp"

namespace qjulia::surface {
namespace {

constexpr double kTip = 0.25;  ///< of a limb's length
/// A limb's tip is so many times as far from the middle as the nearest point outside.
constexpr double kFarthestBody = 1.5;
constexpr double kUnreached = std::numeric_limits<double>::infinity();

/// Calls `take(number, distance in steps)` for the up to 26 points about one.
template <class Take>
void for_neighbours(const Grid& grid, std::int32_t number, const Take& take) {
  const int nx = grid.points[0], ny = grid.points[1], nz = grid.points[2];
  const int i = number % nx, j = number / nx % ny, k = number / nx / ny;
  for (int z = std::max(k - 1, 0); z <= std::min(k + 1, nz - 1); ++z) {
    for (int y = std::max(j - 1, 0); y <= std::min(j + 1, ny - 1); ++y) {
      for (int x = std::max(i - 1, 0); x <= std::min(i + 1, nx - 1); ++x) {
        const int away = std::abs(x - i) + std::abs(y - j) + std::abs(z - k);
        if (away > 0) take((z * ny + y) * nx + x, std::sqrt(static_cast<double>(away)));
      }
    }
  }
}

Eigen::Vector3d place(const Grid& grid, std::int32_t number) {
  const int nx = grid.points[0], ny = grid.points[1];
  const int x = number % nx, y = number / nx % ny, z = number / nx / ny;
  return grid.at(Eigen::Vector3d(x, y, z));
}

/// The point of this side that is nearest to `middle`, and how far it is.
std::pair<std::int32_t, double> nearest(const Grid& grid, const std::vector<bool>& is_inside,
                                        const Eigen::Vector3d& middle, bool side) {
  std::pair<std::int32_t, double> best{-1, kUnreached};
  for (std::int32_t i = 0; i < std::ssize(is_inside); ++i) {
    if (is_inside[static_cast<std::size_t>(i)] != side) continue;
    const double away = (place(grid, i) - middle).norm();
    if (away < best.second) best = {i, away};
  }
  return best;
}

/// Shortest ways through the inside from the point nearest to the middle; Dijkstra's algorithm.
std::vector<double> ways(const Grid& grid, const std::vector<bool>& is_inside,
                         const Eigen::Vector3d& middle) {
  std::vector<double> way(is_inside.size(), kUnreached);
  const std::int32_t start = nearest(grid, is_inside, middle, true).first;
  if (start < 0) return way;
  using Reached = std::pair<double, std::int32_t>;
  std::priority_queue<Reached, std::vector<Reached>, std::greater<>> open;
  way[static_cast<std::size_t>(start)] = 0;
  open.emplace(0, start);
  while (!open.empty()) {
    const auto [here, at] = open.top();
    open.pop();
    if (here > way[static_cast<std::size_t>(at)]) continue;
    for_neighbours(grid, at, [&, here = here](std::int32_t next, double steps) {
      const auto n = static_cast<std::size_t>(next);
      const double there = here + steps * grid.step;
      if (!is_inside[n] || there >= way[n]) return;
      way[n] = there;
      open.emplace(there, next);
    });
  }
  return way;
}

/// The points about `from` that are reached by ways of at least `least`.
std::vector<std::int32_t> beyond(const Grid& grid, const std::vector<double>& way,
                                 std::int32_t from, double least) {
  std::vector<std::int32_t> found{from};
  std::vector<bool> seen(way.size());
  seen[static_cast<std::size_t>(from)] = true;
  for (std::size_t i = 0; i < found.size(); ++i) {
    for_neighbours(grid, found[i], [&](std::int32_t next, double) {
      const auto n = static_cast<std::size_t>(next);
      if (seen[n] || way[n] == kUnreached || way[n] < least) return;
      seen[n] = true;
      found.push_back(next);
    });
  }
  return found;
}

}  // namespace

std::vector<Limb> find_limbs(const Grid& grid, const std::vector<bool>& is_inside,
                             const Eigen::Vector3d& middle, double least) {
  const std::vector<double> way = ways(grid, is_inside, middle);
  const double body = kFarthestBody * nearest(grid, is_inside, middle, false).second;
  std::vector<std::int32_t> order;
  for (std::int32_t i = 0; i < std::ssize(way); ++i) {
    if (way[static_cast<std::size_t>(i)] != kUnreached) order.push_back(i);
  }
  std::ranges::stable_sort(order, std::greater<>(),
                           [&](std::int32_t i) { return way[static_cast<std::size_t>(i)]; });
  // From the farthest point inward: where parts meet, the one that reaches less far is a limb.
  base::UnionFind parts(way.size());
  std::vector<std::int32_t> peak(way.size(), -1);
  std::vector<Limb> limbs;
  const auto end = [&](std::int32_t tip, double root) {
    const double reach = way[static_cast<std::size_t>(tip)], length = reach - root;
    if (length < least || reach < body) return;
    limbs.push_back({length, beyond(grid, way, tip, reach - kTip * length)});
  };
  for (const std::int32_t number : order) {
    const auto here = static_cast<std::uint32_t>(number);
    peak[here] = number;
    for_neighbours(grid, number, [&](std::int32_t next, double) {
      const std::uint32_t mine = parts.root(here),
                          other = parts.root(static_cast<std::uint32_t>(next));
      if (mine == other || peak[other] < 0) return;
      std::int32_t far = peak[mine], near = peak[other];
      if (way[static_cast<std::size_t>(far)] < way[static_cast<std::size_t>(near)]) {
        std::swap(far, near);
      }
      end(near, way[here]);
      parts.unite(mine, other);
      peak[parts.root(here)] = far;
    });
  }
  if (!order.empty()) end(order.front(), 0);
  return limbs;
}

int limbs_kept(const std::vector<Limb>& limbs, const Grid& grid, const std::vector<bool>& is_inside,
               const Eigen::Vector3d& middle) {
  const std::vector<double> way = ways(grid, is_inside, middle);
  return static_cast<int>(std::ranges::count_if(limbs, [&](const Limb& limb) {
    return std::ranges::any_of(
        limb.tip, [&](std::int32_t i) { return way[static_cast<std::size_t>(i)] != kUnreached; });
  }));
}

}  // namespace qjulia::surface
