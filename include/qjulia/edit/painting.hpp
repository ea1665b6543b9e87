#pragma once
/// Paints: which share of a map's detail places have, by hand, by a mesh, by how thick the shape
/// is.

#include <optional>
#include <vector>

#include "qjulia/base/box.hpp"
#include "qjulia/base/progress.hpp"
#include "qjulia/device/device.hpp"
#include "qjulia/map/map.hpp"
#include "qjulia/mesh/painted_mesh.hpp"

namespace qjulia {

/// A ball or a block in which all places have the same share; shape units.
struct PaintBall {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  double radius = 0;
  double share = 0;
};
struct PaintBlock {
  Box box;
  double share = 0;
};

/// Shares that go evenly along an axis, from the low end of the shape's box to the high one.
struct PaintRamp {
  int axis = 1;  ///< 0, 1 or 2
  double low = 1, high = 1;
};

/// What is painted, in this order: ramp and mesh multiply what is there, balls and blocks take its
/// place, and thickness bounds it.
struct PaintOptions {
  static constexpr std::size_t kMostMarks = 256;  ///< balls, and blocks

  double elsewhere = 1;  ///< the share of places that nothing else is said of
  std::optional<PaintRamp> ramp{};
  std::optional<PaintedMesh> mesh{};
  std::vector<PaintBall> balls{};
  std::vector<PaintBlock> blocks{};
  /// The shell is no thicker than this share of the shape's own thickness: of the radius of the
  /// largest ball in the shape that holds the place. Thin limbs then keep their shape.
  std::optional<double> thickness{};

  void validate() const;  ///< @throws OptionError
};

/// The paint. Between cells, and about balls and blocks, shares change smoothly within two or three
/// cells; of these there are at most 128 along the shape's box and 65,536 in all.
/// @throws InputError when the map does not say its box, or its detail where the thickness is asked
///   for; OptionError, Interrupted.
Paint painted(const Device& device, const Map& map, const PaintOptions& options,
              const ProgressMonitor& monitor = {});

/// The map's paint with balls over it, the last one on top. A map without paint counts as having
/// all of its detail everywhere.
/// @throws InputError when the map has no paint and does not say its box; OptionError.
Paint painted_over(const Map& map, const std::vector<PaintBall>& balls);

}  // namespace qjulia
