#pragma once
/// A map of a mesh without a fit: its modulus is the signed distance itself, on a grid, and its
/// versor is free.

#include <cstdint>
#include <optional>
#include <vector>

#include "qjulia/detail_choice.hpp"
#include "qjulia/device.hpp"
#include "qjulia/mesh.hpp"
#include "qjulia/progress.hpp"
#include "qjulia/rational_map.hpp"

namespace qjulia {

struct ExactMapOptions {
  static constexpr int kMostRoots = 1000;

  /// Cells of the distance's grid along its longest side, 32 … 384, rounded up to a multiple of 4.
  /// Higher where limbs are thinner than two cells.
  int resolution = 192;
  /// δ: a thicker shell is a wilder fractal. A number is 0.0001 … 0.1 of the box's diagonal.
  DetailChoice detail = DetailWord::automatic;
  double tufts = 1;            ///< the map's RationalMap::tufts
  std::optional<UpAxis> up{};  ///< the map's RationalMap::up; by default what `guess_up` says
  FourthCoordinate fourth = FourthCoordinate::round;
  /// Roots of the versor, placed inside the shape, 1 … 1000, with whole powers 2 … 13 (as Schor
  /// and Kim 2023 draw them): more roots, finer grooves. Where `factors` are given, they are it.
  int roots = 60;
  std::uint64_t seed = 1;
  /// The versor is this noise, where given, and not of factors; `scale` in cells a map unit, of
  /// which the shape's longest side has 3.
  std::optional<NoiseVersor> noise;
  std::vector<Factor> factors;  ///< in map coordinates of `factors_frame`
  ShapeToMap factors_frame;
  Quaternion phase{1, 0, 0, 0};  ///< p, in front of the versor

  void validate() const;  ///< @throws OptionError
};

/// A map of kind "distance/factors" or "distance/noise", calibrated. The same on every run for the
/// same device.
/// @throws InputError when the mesh has no inside, OptionError when that is thinner than a cell,
///   Interrupted.
RationalMap exact_map(const Device& device, const TriangleMesh& mesh,
                      const ExactMapOptions& options, const ProgressMonitor& monitor = {});

}  // namespace qjulia
