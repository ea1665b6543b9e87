#pragma once
/// The energy that fits minimise, over samples of your own, for other optimisers.

#include <functional>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "qjulia/device/device.hpp"
#include "qjulia/map/field.hpp"
#include "qjulia/map/map.hpp"

namespace qjulia {

/// How F_n at a sample becomes a term of the energy, with w its weight, t its target, s its side.
enum class EnergyLoss {
  /// −w s tanh(α (F_n − t)) (Kim 2015). Every side is 1 or −1. The least sum is −1 where weights
  /// sum to 1.
  tanh,
  /// ½ w (F_n − t)². A sample with a side asks for no more than to be that far out on it: its term
  /// is 0 where s (F_n − t) > 0.
  distance,
  /// w times what EnergyOptions::own says.
  own
};

/// A loss of your own: its value and its derivative by F_n, given F_n and the sample's number,
/// counted from 0. Called on the thread that asks for the energy, sample after sample.
using OwnLoss = std::function<std::pair<double, double>(double field, std::size_t sample)>;

/// Each field suits a regression of F_1 to signed distances.
struct EnergyOptions {
  /// Set `tanh` for the energy of Kim 2015.
  EnergyLoss loss = EnergyLoss::distance;
  /// The loss where `loss` is `own`; only then is there one.
  OwnLoss own;
  /// α of the tanh: raise it and samples near the level count for more.
  double alpha = 1;
  /// n, 1 … kMostIterations. Larger n fit the iterated set itself; the energy is then rough.
  int iterations = 1;
  /// Escape radius, map units, above 0 and at most kLargestEscape: a sample that is not nearer to
  /// the origin has a field that no unknown but the slice changes.
  double escape = kUsualEscape;
  /// Set `dbl` for optimisers that ask for more than six digits. Not every device has it.
  Precision precision = Precision::single;
  /// Makes the map's slice an unknown too, the last one. Samples move with it: the difference
  /// between a sample's W and the slice stays the same. Gradients then take up to twice as long.
  bool slice = false;

  /// @throws OptionError naming the field.
  void validate() const;
};

/// Samples in map coordinates. Vectors have one length, or are empty where that is said.
struct EnergySamples {
  std::vector<Quaternion> points;  ///< 4-D; `on_slice` makes them of 3-D ones
  /// The wanted F_n, such as the signed distance from a surface. Empty: the map's surface level,
  /// for all.
  std::vector<double> targets;
  std::vector<double> sides;    ///< 1 outside, −1 inside, 0 neither; empty: all 0
  std::vector<double> weights;  ///< ≥ 0; empty: 1 / number of samples, for all

  std::size_t size() const { return points.size(); }
  /// @throws OptionError naming the field, where a vector has another length or an element, counted
  /// from 0, that is not allowed. There is at least one sample.
  void validate() const;
};

/// The energy of rational maps with one number K of factors, as a function of their unknowns x: S,
/// then five arrays over the factors: exponents, centres' X, Y, Z, W. That is 1 + 5K numbers; with
/// EnergyOptions::slice one more, the slice.
///
/// It is that of the map's dynamics: steepness, paint and portals are left aside, as in a fit. All
/// else of the map, its phase included, stays as it is.
///
/// An object is for one thread at a time. Functions that take x throw OptionError naming `x` unless
/// it has `size()` finite numbers, and DeviceError where the device refuses. Where unknowns are
/// beyond what a map may have, such as 1e9 map units, energies may be infinite or NaN.
class Energy {
 public:
  /// @throws InputError where the map is not rational or not valid; OptionError from the samples'
  /// and options' validate.
  Energy(const Device& device, const Map& map, const EnergySamples& samples,
         const EnergyOptions& options = {});
  ~Energy();
  Energy(Energy&&) noexcept;
  Energy& operator=(Energy&&) noexcept;

  std::size_t size() const;              ///< unknowns, 1 + 5K or 2 + 5K
  std::vector<double> unknowns() const;  ///< of the map given

  /// The sum over samples. Takes time in proportion to samples × K × n.
  double value(std::span<const double> x) const;
  /// The same, and ∂E/∂x into `gradient`. Takes two to four times as long.
  /// @throws OptionError naming `gradient` unless it has `size()` numbers.
  double value_and_gradient(std::span<const double> x, std::span<double> gradient) const;
  /// F_n at each sample.
  std::vector<double> field_at(std::span<const double> x) const;

  /// The given map with these unknowns, and its layers. @throws InputError naming what is wrong
  /// with such a map.
  Map map_at(std::span<const double> x) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace qjulia
