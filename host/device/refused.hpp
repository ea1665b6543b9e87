#pragma once
/// What a device's error says that it refused: callers then ask for less.

#include "qjulia/error.hpp"

namespace qjulia::device {

/// A buffer was too large for it.
bool is_out_of_memory(const DeviceError& error);

/// A work-group was too large for it.
bool is_refused_group(const DeviceError& error);

}  // namespace qjulia::device
