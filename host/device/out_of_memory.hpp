#pragma once
/// Whether a device's error means that a buffer was too large for it.

#include "qjulia/error.hpp"

namespace qjulia::device {

bool is_out_of_memory(const DeviceError& error);

}  // namespace qjulia::device
