#pragma once
/// Shortest ways between places that have neighbours; Dijkstra's algorithm.

#include <cstddef>
#include <functional>
#include <queue>
#include <utility>
#include <vector>

namespace qjulia::surface {

/// Shortens `ways`, the least known to each place, by those that begin at `sources`.
/// @param for_neighbours (place, take) calls take(neighbour, length of the way there).
template <class ForNeighbours>
void shorten_ways(std::vector<double>& ways, const std::vector<std::size_t>& sources,
                  const ForNeighbours& for_neighbours) {
  using Reached = std::pair<double, std::size_t>;
  std::priority_queue<Reached, std::vector<Reached>, std::greater<>> open;
  for (const std::size_t source : sources) {
    ways[source] = 0;
    open.emplace(0, source);
  }
  while (!open.empty()) {
    const Reached nearest = open.top();
    open.pop();
    if (nearest.first > ways[nearest.second]) continue;
    for_neighbours(nearest.second, [&](std::size_t next, double length) {
      const double there = nearest.first + length;
      if (there >= ways[next]) return;
      ways[next] = there;
      open.emplace(there, next);
    });
  }
}

}  // namespace qjulia::surface
