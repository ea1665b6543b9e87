#include "device_obstacles.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <vector>

#include "qjulia/error.hpp"

namespace qjulia::tools {
KernelCache kernel_cache() {
  if (const char* cache = std::getenv("POCL_CACHE_DIR")) return {"POCL_CACHE_DIR", cache};
  if (const char* cache = std::getenv("XDG_CACHE_HOME")) {
    return {"XDG_CACHE_HOME", std::filesystem::path(cache) / "pocl"};
  }
  if (const char* home = std::getenv("HOME")) {
    return {"HOME", std::filesystem::path(home) / ".cache/pocl"};
  }
  return {"POCL_CACHE_DIR", std::filesystem::temp_directory_path() / "pocl"};
}

namespace {

std::string cache_obstacle() {
  const auto [variable, folder] = kernel_cache();
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  std::string problem = error ? error.message() : "";
  if (!error && ::access(folder.c_str(), W_OK | X_OK) != 0) problem = std::strerror(errno);
  if (problem.empty()) return {};
  return fmt::format(
      "the folder for compiled kernels, '{}' by {}, cannot be written ({}); set POCL_CACHE_DIR to "
      "one that can",
      folder.string(), variable, problem);
}

std::string memory_obstacle() {
  constexpr rlim_t kNeeded = rlim_t{1} << 30;
  rlimit limit{};
  if (::getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur >= kNeeded) return {};
  return fmt::format(
      "the process may use {} MiB of address space only; raise the limit with 'ulimit -v "
      "unlimited'",
      limit.rlim_cur >> 20U);
}

}  // namespace

std::string descriptor_obstacle() {
  constexpr int kNeeded = 12;
  std::vector<int> files;
  bool few = false;
  while (files.size() < kNeeded) {
    const int file = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
    if (file < 0) {
      few = errno == EMFILE;
      break;
    }
    files.push_back(file);
  }
  for (const int file : files) ::close(file);
  rlimit limit{};
  if (!few || ::getrlimit(RLIMIT_NOFILE, &limit) != 0) return {};
  return fmt::format("only {} files may be open at a time; raise the limit with 'ulimit -n 256'",
                     limit.rlim_cur);
}

void expect_descriptors() {
  if (const std::string problem = descriptor_obstacle(); !problem.empty()) {
    throw NoDeviceError(problem);
  }
}

std::string device_obstacle() {
  for (const auto obstacle : {descriptor_obstacle, memory_obstacle, cache_obstacle}) {
    if (std::string text = obstacle(); !text.empty()) return text;
  }
  return {};
}

}  // namespace qjulia::tools
