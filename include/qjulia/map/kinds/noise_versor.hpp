#pragma once
/// The versor of a noise: host/map/kinds/noise_versor.cpp, kernels/noise_versor.clh.

#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "qjulia/base/word.hpp"
#include "qjulia/map/kinds/kind.hpp"

namespace qjulia {

/// Which quaternions a noise gives: the number of their components.
enum class NoiseValues {
  vectors = 3,  ///< W = 0: with the phase 1, images stay in the slice W = 0
  quaternions,  ///< noise in all four components
};

constexpr std::array<Word<NoiseValues>, 2> words(NoiseValues /*of*/) {
  return {{{NoiseValues::vectors, "vectors"}, {NoiseValues::quaternions, "quaternions"}}};
}

/// U = p · n/|n|, n gradient noise at (X, Y, Z) (Perlin 2002): the sum of octaves, each of twice
/// the frequency and half the strength of the one before.
struct NoiseVersor {
  static constexpr const char* kName = "noise";
  static constexpr bool kTakesFactors = false;
  static constexpr int kFileVersion = 2;
  static constexpr int kMostOctaves = 8;
  static constexpr double kLeastScale = 1e-3, kMostScale = 1e4;

  int octaves = 2;         ///< 1 … 8
  double scale = 3;        ///< lattice cells a map unit, of the first octave
  std::uint32_t seed = 1;  ///< another seed is another noise
  NoiseValues values = NoiseValues::vectors;
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< where the lattice begins, map coordinates

  bool operator==(const NoiseVersor&) const = default;
  /// Its members are one object of a map file.
  template <class Self, class Visit>
  static void members(Self& self, const Visit& visit) {
    visit("noise", self);
  }
  /// Calls `visit(name, leaf)` for each member of that object, in the order in which a device holds
  /// them (kernels/layout/noise_layout.h).
  template <class Self, class Visit>
  static void leaves(Self& self, const Visit& visit) {
    visit("octaves", self.octaves);
    visit("scale", self.scale);
    visit("seed", self.seed);
    visit("values", self.values);
    visit("origin", self.origin);
  }
  double cost(const Dynamics& /*map*/) const { return 20.0 * octaves; }  // measured
  static constexpr bool kIsSmooth = false;
  /// @throws InputError naming what is wrong.
  void validate() const;
};

}  // namespace qjulia
