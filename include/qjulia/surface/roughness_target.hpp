#pragma once
/// A map as rough as is asked for: with the detail at which its set has a given area or dimension.

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>

#include "qjulia/base/progress.hpp"
#include "qjulia/base/setting.hpp"
#include "qjulia/device/device.hpp"
#include "qjulia/map/map.hpp"
#include "qjulia/surface/figures.hpp"

namespace qjulia {

/// What is asked for, of the surface at n = 6 without loose pieces.
struct RoughnessTarget {
  std::optional<double> area{};       ///< over that of the reference, 1 … 100
  std::optional<double> dimension{};  ///< box-counting, 1.5 … 3; not with an area
  /// Over that of the reference, 0.1 … 10: the knob `scale` is turned too. With an area or a
  /// dimension only.
  std::optional<double> volume{};
  int resolution = 256;  ///< cells along the surface's box, 64 … 2048: an area is one at a scale

  bool is_set() const { return area || dimension || volume; }
  void validate() const;  ///< @throws OptionError
};

std::span<const SettingOf<RoughnessTarget>> target_settings();

/// What areas and volumes are measured against: a mesh, or a smooth set.
struct RoughnessReference {
  double area = 0, volume = 0;
};

struct TargetedMap {
  Map map;
  double detail = 0;       ///< the fraction of the diagonal that was found
  double scale = 1;        ///< the knob
  SurfaceFigures figures;  ///< of the map's surface
  RoughnessReference reference;
  int surfaces = 0;  ///< that were made on the way
};

/// The map with the detail, and where a volume is asked for the scale, at which its surface has
/// what `target` asks for: an area and a volume to half a per cent, a dimension to 0.005.
/// @param reference by default the map's own surface at n = 1 with the same cells.
/// @throws OptionError naming what cannot be reached, with what can be; InputError for a map whose
///   detail cannot change; Interrupted.
TargetedMap with_roughness(const Device& device, const Map& map, const RoughnessTarget& target,
                           const std::optional<RoughnessReference>& reference = {},
                           const ProgressMonitor& monitor = {});

/// Of the part of a mesh that bounds its inside. @throws InputError, Interrupted.
RoughnessReference reference_of(const Device& device, const TriangleMesh& mesh,
                                const std::stop_token& stop = {});

/// What was reached: detail, scale, area and volume over the reference's, dimension and its error.
nlohmann::json to_json(const TargetedMap& reached);

}  // namespace qjulia
