#pragma once
/// The versor of a map R(q) = e^F(q) U(q): in which direction from the origin each image lies. U, a
/// unit quaternion, has several kinds.
///
/// A kind is a struct here with the members that a map file and a device hold, and its field on the
/// device in kernels/NAME_versor.clh.

#include <Eigen/Core>
#include <cstdint>
#include <variant>

#include "qjulia/base/quaternion.hpp"

namespace qjulia {

/// U = p · Π (q − c_k)^{a_k} / |q − c_k|^{a_k} over the map's factors.
struct FactorsVersor {
  static constexpr const char* kName = "factors";
  static constexpr bool kTakesFactors = true;
  static constexpr int kFileVersion = 1;  ///< the first version of map files that can hold it

  bool operator==(const FactorsVersor&) const = default;

  /// Calls `visit(name, member)` for each member that map files hold.
  template <class Self, class Visit>
  static void members(Self& /*self*/, const Visit& /*visit*/) {}
};

/// U = p · (q² + c) / |q² + c|.
struct QuadraticVersor {
  static constexpr const char* kName = "quadratic";
  static constexpr bool kTakesFactors = false;
  static constexpr int kFileVersion = 1;

  Quaternion c;  ///< map coordinates

  bool operator==(const QuadraticVersor&) const = default;
  template <class Self, class Visit>
  static void members(Self& self, const Visit& visit) {
    visit("c", self.c);
  }
};

/// Which quaternions a noise gives.
enum class NoiseValues {
  vectors,      ///< W = 0: with the phase 1, images stay in the slice W = 0
  quaternions,  ///< noise in all four components
};

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
  /// @throws InputError naming what is wrong.
  void validate() const;
};

using Versor = std::variant<FactorsVersor, QuadraticVersor, NoiseVersor>;

}  // namespace qjulia
