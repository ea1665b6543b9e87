#pragma once
/// Maps between two maps: shape, detail and grooves go from one to the other without a jump.

#include <cstddef>
#include <memory>
#include <vector>

#include "qjulia/base/progress.hpp"
#include "qjulia/device/device.hpp"
#include "qjulia/map/map.hpp"

namespace qjulia {

/// How the factors of two maps go together.
struct MorphPairs {
  std::size_t matched = 0;    ///< of one map with one of the other
  std::size_t appearing = 0;  ///< of the second map alone: their exponents start at 0
  std::size_t vanishing = 0;  ///< of the first alone: their exponents end at 0
};

/// The way from one map to another, both fitted or both exact. In map coordinates, where each has
/// its deepest point at the origin, the shape at t has the potential (1 − t) d_A + t d_B, d being
/// the distances that the two maps hold.
///
/// Of fitted maps, factors are paired so that little exponent is moved far (optimal transport).
/// Centres go straight. Exponents go straight, too, and are then fitted to the wanted potential by
/// least squares over points that stay the same: one solution for each t, which changes smoothly.
/// Factors stay in the first map's order. At 0 the map is the first one; at 1 it has the second
/// one's shape, and grooves of the first one's order.
///
/// Of exact maps, the distances themselves are blended, and factors of versors go as above.
class Morph {
 public:
  /// @throws InputError where the maps are of different kinds, or of kinds that have no way to each
  ///   other; where one has portals or paint, more than kMostMorphFactors factors, or does not say
  ///   its detail, box or inradius. Interrupted.
  Morph(const Device& device, const Map& from, const Map& to, const ProgressMonitor& monitor = {});
  ~Morph();
  Morph(Morph&&) noexcept;
  Morph& operator=(Morph&&) noexcept;

  const MorphPairs& pairs() const;
  /// The map at t, calibrated. @throws OptionError unless t is 0 … 1; Interrupted.
  Map at(double t) const;
  /// A box that all of the shapes lie in, map coordinates.
  Box box() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

constexpr std::size_t kMostMorphFactors = 4000;  ///< pairs take count³ steps
constexpr int kLeastFlickerCells = 8, kMostFlickerCells = 256;

/// How much of a sequence of sets flickers: of the cells of a box, those whose centre changes sides
/// in a step and is back one or two steps later.
struct Flicker {
  double mean = 0;     ///< share of the cells in a step
  double worst = 0;    ///< of one step
  double changed = 0;  ///< mean share of cells that change sides in a step at all
  int steps = 0;       ///< that could be judged: each needs two after it
};

/// Measures a sequence, map by map.
class FlickerMeter {
 public:
  /// @param box map coordinates. @param cells along its longest side, 8 … 256. @param iterations n
  /// @throws OptionError
  FlickerMeter(const Device& device, const Box& box, int cells = 64, int iterations = 6);
  ~FlickerMeter();
  FlickerMeter(FlickerMeter&&) noexcept;
  FlickerMeter& operator=(FlickerMeter&&) noexcept;

  /// The next map of the sequence. @throws InputError, Interrupted
  void add(const Map& map, const std::stop_token& stop = {});
  Flicker flicker() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace qjulia
