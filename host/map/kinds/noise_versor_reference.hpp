#pragma once
/// Gradient noise, by itself.

#include <cstdint>

#include "map/reference_math.hpp"

namespace qjulia::reference {

/// Bits of a lattice point, each the result of all bits of its numbers.
inline std::uint32_t lattice_bits(const std::array<std::int64_t, 3>& point, std::uint32_t salt) {
  constexpr std::array<std::uint32_t, 3> kPrimes{2376512323, 3625334849, 3407524639};
  std::uint32_t bits = salt;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    bits ^= static_cast<std::uint32_t>(point[axis]) * kPrimes[axis];
  }
  bits = (bits ^ bits / 65536) * 2246822507;
  bits = (bits ^ bits / 8192) * 3266489909;
  return bits ^ bits / 65536;
}

/// The sum over the corners of a cell of (gradient · way from the corner), weighted by the fades of
/// the way to the other side.
inline double noise_value(const std::array<double, 3>& at, std::uint32_t salt) {
  double sum = 0;
  for (unsigned corner = 0; corner < 8; ++corner) {
    std::array<std::int64_t, 3> point{};
    std::array<double, 3> way{};
    double weight = 1;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double x = std::clamp(at[axis], -1e6, 1e6);
      point[axis] = static_cast<std::int64_t>(std::floor(x)) + (corner >> axis & 1U);
      way[axis] = x - static_cast<double>(point[axis]);
      const double far = 1 - std::abs(way[axis]);
      weight *= far * far * far * (10 + far * (6 * far - 15));
    }
    const std::uint32_t bits = lattice_bits(point, salt);
    double slope = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::uint32_t part = bits >> 10 * axis & 1023U;
      slope += (static_cast<double>(part) - 511.5) / 512 * way[axis];
    }
    sum += weight * slope;
  }
  return sum;
}

/// n/|n|. It has no derivatives.
template <class T>
QuaternionOf<T> versor_of(const NoiseVersor& noise, const MapOf<T>& /*map*/,
                          const QuaternionOf<T>& q) {
  const std::array<double, 3> x{value_of(q.x) - noise.origin.x(), value_of(q.y) - noise.origin.y(),
                                value_of(q.z) - noise.origin.z()};
  std::array<double, 4> n{};
  const std::uint32_t components = noise.values == NoiseValues::vectors ? 3 : 4;
  for (std::uint32_t c = 0; c < components; ++c) {
    for (std::uint32_t octave = 0; octave < static_cast<std::uint32_t>(noise.octaves); ++octave) {
      std::array<double, 3> at{};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        at[axis] = x[axis] * noise.scale * std::pow(2, octave) + double{0.37F} * c;
      }
      const std::uint32_t salt = (32 * noise.seed + 4 * octave + c) * 2654435769;
      n[c] += noise_value(at, salt) / std::pow(2, octave);
    }
  }
  return power<T>({T(n[0]), T(n[1]), T(n[2]), T(n[3])}, T(1)).versor;
}

}  // namespace qjulia::reference
