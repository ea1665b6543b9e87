#pragma once
/// A set that turns, as a moving picture.

#include <string>

#include "explore/request.hpp"
#include "qjulia/base/progress.hpp"
#include "qjulia/device/device.hpp"
#include "qjulia/map/map.hpp"

namespace qjulia::explore {

/// The bytes of an animated PNG. @param map with its knobs turned. @param monitor gets, at last,
/// what the file holds. @throws InputError, Interrupted
std::string turntable(const Device& device, const Map& map, const MakeRequest& request,
                      const ProgressMonitor& monitor);

}  // namespace qjulia::explore
