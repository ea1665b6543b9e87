#pragma once
#include <string>

namespace qjulia::tools {

/// What keeps OpenCL drivers from showing a device though they are installed: a folder for compiled
/// kernels that cannot be written, limits on open files or memory. Empty: nothing that is known.
std::string device_obstacle();

}  // namespace qjulia::tools
