#include "profile/process_events.hpp"

#include <fmt/format.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <filesystem>
#include <fstream>
#ifdef __linux__
#include <linux/perf_event.h>
#include <sys/syscall.h>
#include <unistd.h>
#endif

#include "qjulia/profile/profile.hpp"

namespace qjulia::profiling {
namespace {

#ifdef __linux__
constexpr std::array<EventKind, kEventNames.size()> kKinds{
    {{kEventNames[0], PERF_TYPE_HARDWARE, PERF_COUNT_HW_CPU_CYCLES, 1},
     {kEventNames[1], PERF_TYPE_HARDWARE, PERF_COUNT_HW_INSTRUCTIONS, 1},
     {kEventNames[2], PERF_TYPE_HARDWARE, PERF_COUNT_HW_CACHE_MISSES, 1},
     {kEventNames[3], PERF_TYPE_HARDWARE, PERF_COUNT_HW_STALLED_CYCLES_FRONTEND, 1},
     {kEventNames[4], PERF_TYPE_HARDWARE, PERF_COUNT_HW_STALLED_CYCLES_BACKEND, 1},
     {kEventNames[5], PERF_TYPE_SOFTWARE, PERF_COUNT_SW_TASK_CLOCK, 1e-9},
     {kEventNames[6], PERF_TYPE_SOFTWARE, PERF_COUNT_SW_PAGE_FAULTS, 1}}};

class SystemEventCalls final : public EventCalls {
 public:
  std::vector<int> threads() override {
    std::vector<int> found;
    std::error_code failed;
    for (const auto& entry : std::filesystem::directory_iterator("/proc/self/task", failed)) {
      const std::string name = entry.path().filename();
      int number = 0;
      std::from_chars(name.data(), name.data() + name.size(), number);
      if (number > 0) found.push_back(number);
    }
    return found;
  }

  int open(const EventKind& kind, int thread) override {
    perf_event_attr wanted{};
    wanted.size = sizeof wanted;
    wanted.type = kind.type;
    wanted.config = kind.config;
    wanted.inherit = 1;
    wanted.exclude_kernel = 1;  // asks for fewer rights
    wanted.exclude_hv = 1;
    wanted.read_format = PERF_FORMAT_TOTAL_TIME_ENABLED | PERF_FORMAT_TOTAL_TIME_RUNNING;
    const long file = ::syscall(SYS_perf_event_open, &wanted, thread, -1, -1, PERF_FLAG_FD_CLOEXEC);
    return file < 0 ? -errno : static_cast<int>(file);
  }

  Value read(int file) override {
    Value value;
    return ::read(file, &value, sizeof value) == sizeof value ? value : Value{};
  }

  void close(int file) override { ::close(file); }

  std::optional<int> paranoia() override {
    int value = 0;
    std::ifstream file("/proc/sys/kernel/perf_event_paranoid");
    return file >> value ? std::optional(value) : std::nullopt;
  }
};
#else
constexpr std::array<EventKind, 0> kKinds{};

class SystemEventCalls final : public EventCalls {
 public:
  std::vector<int> threads() override { return {}; }
  int open(const EventKind&, int) override { return -ENOSYS; }
  Value read(int) override { return {}; }
  void close(int) override {}
  std::optional<int> paranoia() override { return std::nullopt; }
};
#endif

/// Why an event cannot be opened, and what helps.
std::string why_refused(int error, const std::optional<int>& paranoia) {
  constexpr int kUsersOwn = 2;  // a process may still count its own events
  if (error == ENOENT || error == EOPNOTSUPP || error == ENODEV || error == EINVAL) {
    return "this processor shows no such counter; virtual machines often show none";
  }
  if (error == ENOSYS || !paranoia) return "this system has no perf_event_open";
  if (error != EACCES && error != EPERM)
    return fmt::format("perf_event_open fails, errno {}", error);
  if (*paranoia > kUsersOwn) {
    return fmt::format(
        "the kernel does not allow it: /proc/sys/kernel/perf_event_paranoid is {}; 'sysctl "
        "kernel.perf_event_paranoid=2' allows it until the next start",
        *paranoia);
  }
  return fmt::format(
      "perf_event_open is forbidden although perf_event_paranoid is {}, as in containers; give the "
      "container the capability PERFMON, or a seccomp profile that allows the call",
      *paranoia);
}

}  // namespace

std::unique_ptr<EventCalls> system_event_calls() { return std::make_unique<SystemEventCalls>(); }

ProcessEvents::ProcessEvents(std::unique_ptr<EventCalls> calls) : calls_(std::move(calls)) {
  const std::vector<int> threads = calls_->threads();
  std::map<std::string, std::string> names;  // of the events, by the reason
  for (const EventKind& kind : kKinds) {
    int error = 0;
    bool is_open = false;
    for (const int thread : threads) {
      const int file = calls_->open(kind, thread);
      if (file >= 0) {
        counters_.push_back({&kind, file});
        is_open = true;
      } else if (file != -ESRCH) {  // a thread may have ended
        error = -file;
      }
    }
    if (is_open) continue;
    std::string& list = names[why_refused(error == 0 ? ENOSYS : error, calls_->paranoia())];
    if (!list.empty()) list += ", ";
    list += kind.name;
  }
  for (const auto& [why, list] : names) refused_.push_back(fmt::format("{}: {}", list, why));
  if (kKinds.empty()) refused_.emplace_back("all events: this system has no perf_event_open");
}

ProcessEvents::~ProcessEvents() {
  for (const Counter& counter : counters_) calls_->close(counter.file);
}

ProcessEvents::Reading ProcessEvents::read() {
  Reading reading;
  reading.reserve(counters_.size());
  for (const Counter& counter : counters_) reading.push_back(calls_->read(counter.file));
  return reading;
}

std::map<std::string, double> ProcessEvents::between(const Reading& before,
                                                     const Reading& after) const {
  std::map<std::string, double> sums;
  for (std::size_t i = 0; i < counters_.size(); ++i) {
    const auto wanted = static_cast<double>(after[i].wanted - before[i].wanted);
    const auto counted = static_cast<double>(after[i].counted - before[i].counted);
    const auto count = static_cast<double>(after[i].count - before[i].count);
    // A thread that slept all the time wanted nothing, and adds nothing.
    if (wanted > 0 && counted == 0) continue;
    const double scale = counted > 0 ? wanted / counted : 1;
    sums[counters_[i].kind->name] += counters_[i].kind->unit * scale * count;
  }
  return sums;
}

}  // namespace qjulia::profiling
