#include "base/kernel_cache.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <cstring>

namespace qjulia::base {

KernelCache kernel_cache() {
  if (const char* cache = std::getenv("POCL_CACHE_DIR")) return {"POCL_CACHE_DIR", cache};
  if (const char* cache = std::getenv("XDG_CACHE_HOME"); cache != nullptr && *cache != '\0') {
    return {"XDG_CACHE_HOME", std::filesystem::path(cache) / "pocl"};
  }
  if (const char* home = std::getenv("HOME")) {
    return {"HOME", std::string(home) + "/.cache/pocl"};  // PoCL takes an empty one too
  }
  return {"POCL_CACHE_DIR", "/tmp/pocl"};
}

std::string unwritable_cache() {
  const auto [variable, folder] = kernel_cache();
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  std::string problem = error ? error.message() : "";
  if (!error && ::access(folder.c_str(), W_OK | X_OK) != 0) problem = std::strerror(errno);
  if (problem.empty()) return {};
  return fmt::format(
      "PoCL, the driver for CPUs, cannot write to its folder for compiled kernels, '{}' (from {}): "
      "{}; set POCL_CACHE_DIR to a folder that can be written",
      folder.string(), variable, problem);
}

std::string full_cache() {
  // A program of ours takes a tenth of this. PoCL ends the process when it cannot write.
  constexpr std::uintmax_t kNeeded = std::uintmax_t{1} << 20;
  const auto [variable, folder] = kernel_cache();
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  const std::filesystem::space_info space = std::filesystem::space(folder, error);
  if (error || space.available >= kNeeded) return {};
  return fmt::format(
      "the disk of PoCL's folder for compiled kernels, '{}' (from {}), is full ({} KiB are free); "
      "free some space there, or set POCL_CACHE_DIR to a folder on another disk",
      folder.string(), variable, space.available >> 10U);
}

}  // namespace qjulia::base
