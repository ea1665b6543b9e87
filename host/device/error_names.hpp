#pragma once
#include <string>

namespace qjulia::device {

/// OpenCL's name of an error code with the code, "CL_OUT_OF_RESOURCES (-5)"; of a code that neither
/// OpenCL nor a driver is known to have, "OpenCL error (-5000)".
std::string named_error(int code);

/// Whether a driver says so of a device that it has lost: after a crash, a launch that a watchdog
/// ended, or a machine that slept.
bool means_lost_device(int code) noexcept;

}  // namespace qjulia::device
