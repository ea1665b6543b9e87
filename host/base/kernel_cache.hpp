#pragma once
/// The folder in which PoCL keeps compiled kernels.

#include <filesystem>
#include <string>

namespace qjulia::base {

/// The folder's path, and the environment variable that it comes from: pocl(7).
struct KernelCache {
  const char* variable;
  std::filesystem::path folder;
};
KernelCache kernel_cache();

/// Says why nothing can be written there, and what to do; empty where writing works.
std::string unwritable_cache();

/// Says that its disk has no room for another kernel, and what to do; empty where there is room.
std::string full_cache();

}  // namespace qjulia::base
