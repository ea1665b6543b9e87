#include "console/device_obstacles.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <thread>
#include <vector>

#include "qjulia/base/error.hpp"

namespace qjulia::tools {
namespace {

/// Too little address space: drivers then end the process or wait for ever.
std::string memory_obstacle() {
  // PoCL 3.1 with its compiler, and a thread for each core with a stack. With two cores it works in
  // 600,000 KiB and not in 560,000.
  constexpr rlim_t kDriver = rlim_t{576} << 20, kUsualStack = rlim_t{8} << 20;
  rlimit limit{}, stack{};
  if (::getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return {};
  const bool is_known = ::getrlimit(RLIMIT_STACK, &stack) == 0 && stack.rlim_cur != RLIM_INFINITY;
  const rlim_t needed =
      kDriver + std::thread::hardware_concurrency() * (is_known ? stack.rlim_cur : kUsualStack);
  if (limit.rlim_cur >= needed) return {};
  return fmt::format(
      "the process may use only {} MiB of address space, and OpenCL drivers need {}; raise the "
      "limit with 'ulimit -v unlimited'",
      limit.rlim_cur >> 20U, needed >> 20U);
}

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

}  // namespace

std::string limit_obstacle() {
  const std::string descriptors = descriptor_obstacle();
  return descriptors.empty() ? memory_obstacle() : descriptors;
}

void expect_room_for_drivers() {
  if (const std::string problem = limit_obstacle(); !problem.empty()) throw NoDeviceError(problem);
}

}  // namespace qjulia::tools
