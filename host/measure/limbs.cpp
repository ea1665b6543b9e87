#include "measure/limbs.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>

#include "base/union_find.hpp"
#include "measure/shortest_ways.hpp"

namespace qjulia::surface {
namespace {

constexpr double kTip = 0.25;  ///< times a limb's length
/// A limb's tip is so many times as far from the origin as the nearest point outside.
constexpr double kFarthestBody = 1.5;
constexpr double kUnreached = std::numeric_limits<double>::infinity();

/// Calls `take(number, distance in steps)` for the up to 26 points about one.
template <class Take>
void for_neighbours(const Grid& grid, std::size_t number, const Take& take) {
  const Eigen::Vector3i middle = index_of(number, grid.points);
  for_around(grid.points, middle, 1, [&](std::size_t next, const Eigen::Vector3i& index) {
    if (next != number) take(next, std::sqrt((index - middle).cwiseAbs().sum()));
  });
}

/// The point of this side that is nearest to the origin, and how far it is.
std::pair<std::size_t, double> nearest(const Grid& grid, const std::vector<bool>& is_inside,
                                       bool side) {
  std::pair<std::size_t, double> best{0, kUnreached};
  for_points(grid.points, [&](std::size_t number, const Eigen::Vector3i& index) {
    if (is_inside[number] != side) return;
    const double away = grid.point(index).norm();
    if (away < best.second) best = {number, away};
  });
  return best;
}

/// Shortest ways through the inside from the point nearest to the origin.
std::vector<double> ways(const Grid& grid, const std::vector<bool>& is_inside) {
  std::vector<double> way(is_inside.size(), kUnreached);
  const auto [start, away] = nearest(grid, is_inside, true);
  if (away == kUnreached) return way;
  shorten_ways(way, {start}, [&](std::size_t from, const auto& take) {
    for_neighbours(grid, from, [&](std::size_t next, double steps) {
      if (is_inside[next]) take(next, steps * grid.step);
    });
  });
  return way;
}

/// The points about `from` that are reached by ways of at least `least`.
std::vector<std::size_t> beyond(const Grid& grid, const std::vector<double>& way, std::size_t from,
                                double least) {
  std::vector<std::size_t> found{from};
  std::vector<bool> seen(way.size());
  seen[from] = true;
  for (std::size_t i = 0; i < found.size(); ++i) {
    for_neighbours(grid, found[i], [&](std::size_t next, double) {
      if (seen[next] || way[next] == kUnreached || way[next] < least) return;
      seen[next] = true;
      found.push_back(next);
    });
  }
  return found;
}

}  // namespace

std::vector<Limb> find_limbs(const Grid& grid, const std::vector<bool>& is_inside, double least) {
  const std::vector<double> way = ways(grid, is_inside);
  const double body = kFarthestBody * nearest(grid, is_inside, false).second;
  std::vector<std::uint32_t> order;
  for (std::uint32_t i = 0; i < way.size(); ++i) {
    if (way[i] != kUnreached) order.push_back(i);
  }
  std::ranges::stable_sort(order, std::greater<>(), [&](std::uint32_t i) { return way[i]; });
  // From the farthest point inward: where parts meet, the one that reaches less far is a limb.
  constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  base::UnionFind parts(way.size());
  std::vector<std::uint32_t> peak(way.size(), kNone);
  std::vector<Limb> limbs;
  const auto end = [&](std::uint32_t tip, double root) {
    const double reach = way[tip], length = reach - root;
    if (length < least || reach < body) return;
    limbs.push_back({length, beyond(grid, way, tip, reach - kTip * length)});
  };
  for (const std::uint32_t here : order) {
    peak[here] = here;
    for_neighbours(grid, here, [&](std::size_t next, double) {
      const std::uint32_t mine = parts.root(here);
      const std::uint32_t other = parts.root(static_cast<std::uint32_t>(next));
      if (mine == other || peak[other] == kNone) return;
      std::uint32_t far = peak[mine], near = peak[other];
      if (way[far] < way[near]) std::swap(far, near);
      end(near, way[here]);
      parts.unite(mine, other);
      peak[parts.root(here)] = far;
    });
  }
  if (!order.empty()) end(order.front(), 0);
  return limbs;
}

int limbs_kept(const std::vector<Limb>& limbs, const Grid& grid,
               const std::vector<bool>& is_inside) {
  const std::vector<double> way = ways(grid, is_inside);
  return static_cast<int>(std::ranges::count_if(limbs, [&](const Limb& limb) {
    return std::ranges::any_of(limb.tip, [&](std::size_t i) { return way[i] != kUnreached; });
  }));
}

}  // namespace qjulia::surface
