#pragma once
/// d₄ / δ, with d from the splines of a grid.

#include "map/reference_math.hpp"

namespace qjulia::reference {

/// Both splines of a grid, each by itself; cells.
template <class T>
T grid_distance(const DistanceGridData& data, const std::array<T, 3>& at) {
  const std::array<int, 3> coarse = data.coarse_cells();
  const auto wide = [](int n) { return static_cast<std::size_t>(n); };
  const auto number = [nx = wide(coarse[0]), ny = wide(coarse[1]), wide](int i, int j, int k) {
    return (wide(k) * ny + wide(j)) * nx + wide(i);
  };
  const auto correction = [&](int i, int j, int k) {
    const auto block = static_cast<std::uint32_t>(number(i / 4, j / 4, k / 4));
    const auto found = std::ranges::lower_bound(data.blocks, block);
    if (found == data.blocks.end() || *found != block) return 0.0;
    const auto cell = static_cast<std::size_t>((k % 4 * 4 + j % 4) * 4 + i % 4);
    return data.corrections[64 * static_cast<std::size_t>(found - data.blocks.begin()) + cell] /
           256.0;
  };
  return spline_sum<T>({T(at[0] / 4), T(at[1] / 4), T(at[2] / 4)},
                       [&](int i, int j, int k) { return data.coarse[number(i, j, k)] / 64.0; }) +
         spline_sum<T>(at, correction);
}

/// d₄ / δ.
template <class T>
T modulus_of(const DistanceModulus& modulus, const MapOf<T>& /*map*/, const QuaternionOf<T>& q) {
  using std::sqrt;
  const DistanceGridData& data = modulus.grid->data();
  const auto [at, beyond2] = place_in(data.cells, modulus.origin, modulus.step, 4, q);
  T d = grid_distance(data, at);
  if (value_of(beyond2) > 0) d += sqrt(beyond2);
  const T depth = d * modulus.step + modulus.inradius;
  const bool is_round = modulus.fourth == FourthCoordinate::round;
  const T radius = is_round ? T(sqrt(depth * depth + q.w * q.w)) : depth;
  return (radius - modulus.inradius) / modulus.shell;
}

}  // namespace qjulia::reference
