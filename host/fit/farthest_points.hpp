#pragma once
/// Farthest-point sampling (Gonzalez 1985).

#include <algorithm>
#include <cstddef>
#include <limits>
#include <vector>

namespace qjulia::fitting {

struct FarthestPoints {
  std::vector<std::size_t> chosen;   ///< in the order of choice
  std::vector<std::size_t> nearest;  ///< for each point, the place in `chosen` of the nearest
};

/// Chooses `count` of `points` points, `first` first, then always the one farthest from those
/// chosen. Twins are chosen once there is nothing else.
/// @param gap gap(i, j), growing with the distance of point i from point j.
template <class Gap>
FarthestPoints farthest_points(std::size_t points, std::size_t count, std::size_t first,
                               const Gap& gap) {
  FarthestPoints found;
  found.chosen.reserve(count);
  found.nearest.assign(points, 0);
  std::vector<double> least(points, std::numeric_limits<double>::infinity());
  for (std::size_t next = first; found.chosen.size() < count;) {
    for (std::size_t i = 0; i < points; ++i) {
      const double g = gap(i, next);
      if (g >= least[i]) continue;
      least[i] = g;
      found.nearest[i] = found.chosen.size();
    }
    found.chosen.push_back(next);
    next = static_cast<std::size_t>(std::ranges::max_element(least) - least.begin());
  }
  return found;
}

}  // namespace qjulia::fitting
