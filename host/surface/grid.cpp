#include "surface/grid.hpp"

#include <algorithm>
#include <cmath>

namespace qjulia {

double Grid::coordinate(int axis, int index, Precision precision) const {
  if (precision == Precision::dbl) return std::fma(index, step, origin[axis]);
  return std::fma(static_cast<float>(index), static_cast<float>(step),
                  static_cast<float>(origin[axis]));
}

std::size_t GridBlock::size() const {
  std::size_t points = 1;
  for (const int n : count) points *= static_cast<std::size_t>(n);
  return points;
}

GridBlock slices(const Grid& grid, int z, int count) {
  return {{0, 0, z}, {grid.points[0], grid.points[1], count}};
}

int slices_at_once(const Grid& grid) {
  constexpr std::size_t kPoints = std::size_t{1} << 20;
  return static_cast<int>(std::max<std::size_t>(1, kPoints / slices(grid, 0, 1).size()));
}

}  // namespace qjulia
