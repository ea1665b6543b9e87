#include "energy/neighbour_blocks.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <numeric>
#include <span>

namespace qjulia::energy {
namespace {

Eigen::Vector3d place(const Map& map, std::size_t factor) {
  const Quaternion& c = map.dynamics.factors[factor].center;
  return {c.x, c.y, c.z};
}

/// Adds `count` blocks of these factors.
void divide(const Map& map, std::span<std::size_t> factors, std::size_t count,
            NeighbourBlocks& blocks) {
  if (count == 1) {
    std::ranges::sort(factors);
    blocks.emplace_back(factors.begin(), factors.end());
    return;
  }
  Eigen::AlignedBox3d box;
  for (const std::size_t k : factors) box.extend(place(map, k));
  Eigen::Index longest = 0;
  box.sizes().maxCoeff(&longest);
  const std::size_t low = count / 2;
  const std::size_t cut = factors.size() * low / count;
  // Factors in one place are ordered by their numbers, so that every machine cuts alike.
  std::ranges::nth_element(factors, factors.begin() + static_cast<std::ptrdiff_t>(cut), {},
                           [&](std::size_t k) { return std::pair(place(map, k)[longest], k); });
  divide(map, factors.first(cut), low, blocks);
  divide(map, factors.subspan(cut), count - low, blocks);
}

}  // namespace

NeighbourBlocks neighbour_blocks(const Map& map, std::size_t most) {
  std::vector<std::size_t> factors(map.dynamics.factors.size());
  std::iota(factors.begin(), factors.end(), std::size_t{0});
  NeighbourBlocks blocks;
  divide(map, factors, std::max<std::size_t>(1, (factors.size() + most - 1) / most), blocks);
  return blocks;
}

std::vector<Eigen::Index> variables_of(const std::vector<std::size_t>& block, std::size_t factors) {
  std::vector<Eigen::Index> numbers;
  for (std::size_t component = 0; component < 5; ++component) {
    for (const std::size_t k : block) {
      numbers.push_back(static_cast<Eigen::Index>(1 + component * factors + k));
    }
  }
  return numbers;
}

}  // namespace qjulia::energy
