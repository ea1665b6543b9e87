#pragma once
#include <filesystem>
#include <string>

namespace qjulia::tools {

/// Where PoCL keeps compiled kernels, and the environment variable that says so: pocl(7).
struct KernelCache {
  const char* variable;
  std::filesystem::path folder;
};
KernelCache kernel_cache();

/// What keeps OpenCL drivers from showing a device though they are installed: a folder for compiled
/// kernels that cannot be written, limits on open files or memory. Empty: nothing that is known.
std::string device_obstacle();

/// The same of limits on open files alone.
std::string descriptor_obstacle();

/// Call it before drivers are asked: some end the process when too few files may be open.
/// @throws NoDeviceError
void expect_descriptors();

}  // namespace qjulia::tools
