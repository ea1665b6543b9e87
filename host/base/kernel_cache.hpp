#pragma once
/// The folder in which PoCL keeps compiled kernels.

#include <filesystem>
#include <string>

namespace qjulia::base {

/// Where it is, and the environment variable that says so: pocl(7).
struct KernelCache {
  const char* variable;
  std::filesystem::path folder;
};
KernelCache kernel_cache();

/// Why nothing can be written there, and what to do; empty where it can be written.
std::string unwritable_cache();

/// That its disk has no room for another kernel, and what to do; empty where it has.
std::string full_cache();

}  // namespace qjulia::base
