#include "profile/processor_watch.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <fstream>
#include <sstream>

namespace qjulia::profiling {
namespace {

double wall_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// CPU seconds of this process.
double own_seconds() {
  std::timespec time{};
  ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// The files that may count how often this process's control group was stopped: of version 2 of
/// such groups and of version 1, by the group's path and, in a container, without it.
std::vector<std::filesystem::path> group_files(const std::filesystem::path& root) {
  std::vector<std::filesystem::path> files;
  std::ifstream groups(root / "proc/self/cgroup");
  std::string line;
  while (std::getline(groups, line)) {  // NUMBER:CONTROLLERS:/PATH
    const std::size_t first = line.find(':'), second = line.find(':', first + 1);
    if (first == std::string::npos || second == std::string::npos) continue;
    const std::string controllers = line.substr(first + 1, second - first - 1);
    const std::string path = line.substr(std::min(second + 2, line.size()));
    std::istringstream names(controllers);
    bool has_cpu = controllers.empty();  // version 2
    for (std::string name; std::getline(names, name, ',');) has_cpu = has_cpu || name == "cpu";
    if (!has_cpu) continue;
    const std::filesystem::path folder = root / "sys/fs/cgroup" / controllers;
    files.push_back(folder / path / "cpu.stat");
    files.push_back(folder / "cpu.stat");
  }
  return files;
}

}  // namespace

ProcessorWatch::ProcessorWatch(const std::filesystem::path& root)
    : root_(root), groups_(group_files(root)), before_(read()) {}

std::optional<ProcessorWatch::Reading> ProcessorWatch::read() const {
  std::ifstream stat(root_ / "proc/stat");
  std::string name;
  double user = 0, nice = 0, system = 0, idle = 0, waiting = 0, irq = 0, soft = 0, stolen = 0;
  stat >> name >> user >> nice >> system >> idle >> waiting >> irq >> soft >> stolen;
  if (!stat || name != "cpu") return std::nullopt;
  const auto ticks = static_cast<double>(::sysconf(_SC_CLK_TCK));
  Reading now;
  now.wall = wall_seconds();
  now.own = own_seconds();
  now.busy = (user + nice + system + irq + soft) / ticks;
  now.stolen = stolen / ticks;
  for (std::string line; std::getline(stat, line);) {
    if (line.starts_with("cpu")) ++now.processors;
  }
  for (const std::filesystem::path& file : groups_) {
    std::ifstream group(file);
    std::string word;
    double value = 0;
    bool is_found = false;
    while (group >> word >> value) {
      if (word == "nr_throttled") {
        now.throttled_times = static_cast<std::uint64_t>(value);
        is_found = true;
      }
      if (word == "throttled_usec") now.throttled_seconds = 1e-6 * value;
      if (word == "throttled_time") now.throttled_seconds = 1e-9 * value;
    }
    if (is_found) break;
  }
  return now;
}

std::optional<ProcessorUse> ProcessorWatch::so_far() const {
  if (!before_) return std::nullopt;
  const auto now = read();
  const double seconds = now ? now->wall - before_->wall : 0;
  if (!(seconds > 0)) return std::nullopt;
  ProcessorUse use;
  use.seconds = seconds;
  use.processors = now->processors;
  const double own = now->own - before_->own;
  use.others = std::max(0.0, now->busy - before_->busy - own) / seconds;
  use.stolen = std::max(0.0, now->stolen - before_->stolen) / seconds;
  // A process that was moved to another group reads another count.
  if (now->throttled_times > before_->throttled_times) {
    use.throttled_times = now->throttled_times - before_->throttled_times;
    use.throttled_seconds = std::max(0.0, now->throttled_seconds - before_->throttled_seconds);
  }
  return use;
}

std::vector<std::string> reasons(const ProcessorUse& use) {
  constexpr double kFew = 0.05;  // of a processor
  std::vector<std::string> found;
  if (use.others > kFew) {
    found.push_back(
        fmt::format("other programs had {:.1f} of {} processors", use.others, use.processors));
  }
  if (use.stolen > kFew) {
    found.push_back(fmt::format("the host of this virtual machine kept {:.1f} of {} processors",
                                use.stolen, use.processors));
  }
  if (use.throttled_times > 0) {
    found.push_back(fmt::format(
        "a quota of processors stopped this program {} time{}, for {:.2g} s", use.throttled_times,
        use.throttled_times == 1 ? "" : "s", use.throttled_seconds));
  }
  return found;
}

}  // namespace qjulia::profiling
