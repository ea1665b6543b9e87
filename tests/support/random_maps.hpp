#pragma once
/// Seeded random maps and samples for checking kernels.

#include <random>

#include "energy/samples.hpp"
#include "qjulia/map/map.hpp"

namespace qjulia::test {

/// Uniform in [low, high), from the generator's bits alone.
inline double uniform(std::mt19937_64& bits, double low, double high) {
  return low + (high - low) * static_cast<double>(bits() >> 11) * 0x1p-53;
}

/// `count` factors with centres in [-1, 1]^3 x [-0.1, 0.1], |exponent| in [least, most), 57 %
/// roots.
inline Map random_map(std::size_t count, double least, double most, std::uint64_t seed) {
  std::mt19937_64 bits(seed);
  Map map;
  map.dynamics.log_scale = 0.05;
  for (std::size_t i = 0; i < count; ++i) {
    const double sign = i < count * 57 / 100 ? 1 : -1;
    map.dynamics.factors.push_back({{uniform(bits, -1, 1), uniform(bits, -1, 1),
                                     uniform(bits, -1, 1), uniform(bits, -0.1, 0.1)},
                                    sign * uniform(bits, least, most)});
  }
  return map;
}

/// Points uniform in [-1.5, 1.5]^3 with weights of sum 1, targets and sides.
inline energy::Samples random_samples(std::size_t count, std::uint64_t seed) {
  std::mt19937_64 bits(seed);
  energy::Samples samples;
  for (std::size_t i = 0; i < count; ++i) {
    // One by one: compilers choose in which order they compute a call's arguments.
    const double z = uniform(bits, -1.5, 1.5);
    const double y = uniform(bits, -1.5, 1.5);
    const double x = uniform(bits, -1.5, 1.5);
    samples.add({x, y, z}, 1.0 / static_cast<double>(count), uniform(bits, -0.5, 0.5),
                i % 3 == 0 ? -1 : 1);
  }
  return samples;
}

}  // namespace qjulia::test
