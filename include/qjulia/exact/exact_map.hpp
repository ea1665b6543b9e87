#pragma once
/// A map of a mesh without a fit: its modulus is the signed distance itself, on a grid, and its
/// versor is free.

#include <cstdint>
#include <optional>
#include <variant>
#include <vector>

#include "qjulia/base/detail_choice.hpp"
#include "qjulia/base/progress.hpp"
#include "qjulia/device/device.hpp"
#include "qjulia/map/map.hpp"
#include "qjulia/mesh/mesh.hpp"

namespace qjulia {

/// A versor of roots at random places inside the shape, with whole powers 2 … 13 (as Schor and Kim
/// 2023 draw them): more roots, finer grooves.
struct RandomRoots {
  static constexpr int kMostRoots = 1000;
  int roots = 60;  ///< 1 … 1000
  std::uint64_t seed = 1;
};

/// A versor of another map's factors, which keep their places in the shape.
struct FactorsOfMap {
  std::vector<Factor> factors;
  ShapeToMap shape_to_map;  ///< the other map's
};

struct ExactMapOptions {
  /// Cells of the distance's grid along its longest side, 32 … 384, rounded up to a multiple of 4.
  /// Higher where limbs are thinner than two cells.
  int resolution = 192;
  /// δ: a thicker shell is a wilder fractal. A number is 0.0001 … 0.1 of the box's diagonal.
  DetailChoice detail = DetailWord::automatic;
  double steepness = 1;        ///< the map's Layers::steepness
  std::optional<UpAxis> up{};  ///< the map's Frame::up; by default what `guess_up` says
  FourthCoordinate fourth = FourthCoordinate::round;
  /// What gives the grooves their pattern. The scale of a noise is in cells a map unit, of which
  /// the shape's longest side has 3.
  std::variant<RandomRoots, FactorsOfMap, NoiseVersor> versor;
  Quaternion phase{1, 0, 0, 0};  ///< p, in front of the versor

  void validate() const;  ///< @throws OptionError
};

/// A map of kind "distance/factors" or "distance/noise", calibrated. The same on every run for the
/// same device.
/// @throws InputError when the mesh has no inside, OptionError when that is thinner than a cell,
///   Interrupted.
Map exact_map(const Device& device, const TriangleMesh& mesh, const ExactMapOptions& options,
              const ProgressMonitor& monitor = {});

}  // namespace qjulia
