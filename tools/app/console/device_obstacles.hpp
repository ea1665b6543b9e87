#pragma once
#include <string>

namespace qjulia::tools {

/// A limit of this process within which OpenCL drivers cannot work, and what to do: too few open
/// files, or too little address space. Empty: none.
std::string limit_obstacle();

/// Call it before drivers are asked: within such limits, some end the process or wait for ever.
/// @throws NoDeviceError
void expect_room_for_drivers();

}  // namespace qjulia::tools
