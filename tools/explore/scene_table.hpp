#pragma once
/// What a page that draws by itself knows of its map over the ranges of its knobs: it looks up what
/// else would have to be measured.

#include <array>
#include <cstdint>
#include <stop_token>
#include <string>
#include <vector>

#include "qjulia/base/box.hpp"
#include "qjulia/device/device.hpp"
#include "qjulia/map/map.hpp"

namespace qjulia::explore {

/// Values of a knob, rising, that divide its range into cells. A knob that the map does not bear
/// has one cell.
struct KnobNodes {
  std::string knob;
  std::vector<double> nodes;

  std::size_t cells() const { return nodes.size() - 1; }
  /// The cell that holds a value; values beyond the range belong to the cells at its ends.
  std::size_t cell_of(double value) const;
};

/// Radii about the origin of iteration that settle orbits, map units, as in StopRadii.
struct OuterRadii {
  double outer = 0, escape = 0;
};

/// Lengths are map units; boxes lie in the file's map coordinates, whatever the drift.
struct SceneTable {
  /// What a cell of the table says: rows of the lists below.
  struct Entry {
    std::uint8_t inner = 0, outer = 0;
    std::uint8_t band = 0;          ///< of `boxes`
    std::uint8_t slope = 0;         ///< of `slopes`, where orbits have several iterates
    std::uint8_t single_slope = 0;  ///< the same, where they have one
  };

  /// Detail, drift, scale, steepness. What an entry says is safe everywhere in its cell.
  std::array<KnobNodes, 4> knobs;
  std::vector<Entry> entries;  ///< a cell's each, steepness fastest
  std::vector<double> inner;   ///< r_in; the first is 0: there is none
  std::vector<OuterRadii> outer;

  /// The calibrated surface level at these drifts; it is linear in between, to `kLevelError`.
  std::vector<double> drifts, levels;
  static constexpr double kLevelError = 5e-3;

  KnobNodes slices;
  /// For each cell of `slices` and each band: what holds the points that are so near the shape.
  std::vector<std::vector<Box>> boxes;
  /// For each cell of `slices`: slopes of F_1 at the file's own detail, without steepness.
  std::vector<std::vector<double>> slopes;

  const Entry& entry_at(double detail, double drift, double scale, double steepness) const;
};

/// @throws InputError, DeviceError, Interrupted
SceneTable scene_table(const Device& device, const Map& map, const std::stop_token& stop = {});

}  // namespace qjulia::explore
