#pragma once
/// Files made of what a page shows: meshes, and turntables as moving pictures.

#include <string>

#include "explore/request.hpp"
#include "qjulia/device.hpp"
#include "qjulia/progress.hpp"
#include "qjulia/rational_map.hpp"

namespace qjulia::explore {

/// The bytes of the file, as `qjulia surface` or `render --turntable` would make it.
/// @param monitor is told, at last, what the file holds. @throws InputError, Error where the set is
///   empty, Interrupted
std::string made_file(const Device& device, const RationalMap& map, const MakeRequest& request,
                      const ProgressMonitor& monitor);

}  // namespace qjulia::explore
