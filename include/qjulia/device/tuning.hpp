#pragma once
/// How a device's work is cut into work-items.

#include <nlohmann/json_fwd.hpp>

namespace qjulia {

/// Other settings take sums in another order: results differ in rounding only, but differ. The
/// defaults are the same on all devices of a kind; `tune` (tune.hpp) finds the best of one device.
struct Tuning {
  int lane_width = 1;      ///< samples, points or factors a work-item computes side by side
  int energy_vectors = 1;  ///< lane vectors of samples a work-item of the energy takes
  int gradient_rows = 1;   ///< work-items the samples are divided over for the gradient, n = 1
  int orbit_items = 1;     ///< most groups of work-items of the gradient at n > 1
  int orbit_group = 1;     ///< work-items of such a group: they sum in local memory; 1: privately
  int panel_samples = 1;   ///< samples whose Jacobian is held at a time for the Gauss-Newton matrix
  int panel_block = 1;     ///< how many of these samples a work-item computes
  int product_side = 1;    ///< 16: 16 × 16 work-items share tiles of that matrix; 1: none do

  bool operator==(const Tuning&) const = default;
  /// @throws InputError naming the setting that is out of range.
  void validate() const;
};

nlohmann::json to_json(const Tuning& tuning);

/// @throws InputError when a setting is missing, unknown or out of range.
Tuning tuning_from(const nlohmann::json& json);

}  // namespace qjulia
