#pragma once
/// What a fit needs to know about the shape that it fits a map to.

#include <memory>
#include <string>
#include <vector>

#include "base/random.hpp"
#include "fit/energy_names.hpp"
#include "fit/schedule.hpp"

namespace qjulia::fitting {

/// A map in the form in which a fit that ends with it would give it.
struct FinishedMap {
  Map map;
  std::vector<std::string> warnings;  ///< what a user should know about it, a sentence each
};

/// A shape to fit a map to. Everything is in map coordinates.
class Problem {
 public:
  virtual ~Problem() = default;

  /// Draws a stage's samples. @throws Interrupted
  virtual Samples draw(const Level& level, base::Random& random) const = 0;
  /// An evaluator of the energy over these samples.
  virtual std::unique_ptr<Evaluator> evaluator(const Samples& samples,
                                               const EnergySettings& options) const = 0;
  /// Signed distances of points to the surface.
  virtual std::vector<double> distances(const std::vector<Eigen::Vector3d>& points) const = 0;
  /// IoU, 0 … 1, of {F_n < map.surface_level} and the inside of the shape, on a coarse grid.
  virtual double overlap(const Map& map, int iterations) const = 0;
  /// The map that a fit gives if it ends with `map`, which is in distance units or was polished: it
  /// has the wanted detail.
  virtual FinishedMap finished(const Map& map) const = 0;
  /// The map that a stage starts from; if several processes fit together, the same one for all.
  virtual Map agreed(Map map) const { return map; }

 protected:
  Problem() = default;
  Problem(const Problem&) = default;
  Problem& operator=(const Problem&) = default;
};

}  // namespace qjulia::fitting
