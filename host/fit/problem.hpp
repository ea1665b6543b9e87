#pragma once
/// What a fit asks about the shape that its map is to have.

#include <memory>
#include <string>
#include <vector>

#include "base/random.hpp"
#include "fit/evaluator.hpp"
#include "fit/schedule.hpp"

namespace qjulia::fitting {

/// A map with the wanted detail.
struct FinishedMap {
  RationalMap map;
  std::vector<std::string> warnings;  ///< what a user should know about it, a sentence each
};

/// A shape to fit a map to. Everything is in map coordinates.
class Problem {
 public:
  virtual ~Problem() = default;

  /// A stage's samples. @throws Interrupted
  virtual Samples draw(const Level& level, base::Random& random) const = 0;
  /// What sums the energy over these samples.
  virtual std::unique_ptr<Evaluator> evaluator(const Samples& samples,
                                               const EnergyOptions& options) const = 0;
  /// Signed distances of points to the surface.
  virtual std::vector<double> distances(const std::vector<Eigen::Vector3d>& points) const = 0;
  /// IoU, 0 … 1, of {F_n < map.surface_level} and the inside of the shape, on a coarse grid.
  virtual double overlap(const RationalMap& map, int iterations) const = 0;
  /// The map in distance units, or polished since, given the wanted detail.
  /// @param iou what its last stage reached.
  virtual FinishedMap finished(const RationalMap& map, double iou) const = 0;
  /// The map that a stage starts from: one for all where several processes fit together.
  virtual RationalMap agreed(RationalMap map) const { return map; }

 protected:
  Problem() = default;
  Problem(const Problem&) = default;
  Problem& operator=(const Problem&) = default;
};

}  // namespace qjulia::fitting
