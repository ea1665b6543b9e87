#pragma once
/// The maps of a morph in equal steps, and how much they flicker.

#include <functional>
#include <span>

#include "qjulia/base/setting.hpp"
#include "qjulia/morph/morph.hpp"

namespace qjulia {

struct MorphOptions {
  int steps = 48;          ///< maps, the first and the last included, 2 … 9999
  int flicker_cells = 64;  ///< as `FlickerMeter` takes them; 0: flicker is not measured
  void validate() const;   ///< @throws OptionError
};

std::span<const SettingOf<MorphOptions>> morph_settings();

/// Makes the maps one after the other, from t = 0 to t = 1. Their provenance says "t" and "step".
/// @param take gets each map and its number, from 1 on.
/// @return zeros where flicker is not measured. @throws OptionError, Interrupted, what `take`
/// throws
Flicker make_steps(const Device& device, const Morph& morph, const MorphOptions& options,
                   const std::function<void(Map map, int step)>& take,
                   const ProgressMonitor& monitor = {});

}  // namespace qjulia
