#pragma once
#include <string>

namespace qjulia::device {

/// OpenCL's name of an error code with the code, "CL_OUT_OF_RESOURCES (-5)"; for an unknown code,
/// "OpenCL error (-5000)".
std::string named_error(int code);

/// Whether a driver reports with this code that it has lost the device: after a crash, a launch
/// that a watchdog ended, or a machine that slept.
bool means_lost_device(int code) noexcept;

}  // namespace qjulia::device
