#include "jobs/check_process.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <fnmatch.h>
#include <poll.h>
#include <spawn.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstring>
#include <limits>
#include <optional>

#include "base/text.hpp"
#include "console/failure.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/device/tuning_cache.hpp"

namespace qjulia::tools {
namespace {

/// A process that runs this program, and what it says on standard output.
class CheckProcess {
 public:
  /// @throws Error
  explicit CheckProcess(std::vector<std::string> arguments) {
    std::array<int, 2> pipe{};
    if (::pipe2(pipe.data(), O_CLOEXEC) != 0) fail(errno);
    output_ = pipe[0];
    std::vector<char*> words;
    words.reserve(arguments.size() + 1);
    for (std::string& argument : arguments) words.push_back(argument.data());
    words.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    int code = ::posix_spawn_file_actions_init(&actions);
    if (code == 0) {
      ::posix_spawn_file_actions_adddup2(&actions, pipe[1], STDOUT_FILENO);
      code = ::posix_spawn(&child_, "/proc/self/exe", &actions, nullptr, words.data(), environ);
      ::posix_spawn_file_actions_destroy(&actions);
    }
    ::close(pipe[1]);
    if (code == 0) return;
    ::close(output_);
    fail(code);
  }
  ~CheckProcess() {
    ::close(output_);
    if (child_ == 0) return;
    ::kill(child_, SIGKILL);
    end();
  }
  CheckProcess(const CheckProcess&) = delete;
  CheckProcess& operator=(const CheckProcess&) = delete;

  /// From now on, it may take so long until the next call of this.
  void allow(std::chrono::seconds time) { latest_ = Clock::now() + time; }

  /// Returns the next line, or nothing when there are no more. Where the time that it may take is
  /// over, it kills the process and returns nothing. When a stop is requested, it asks the process
  /// to end, and a second later once more, which such a process obeys whatever it does.
  std::optional<std::string> line(const std::stop_token& stop) {
    constexpr int kMilliseconds = 100;
    while (text_.find('\n') == std::string::npos) {
      if (stop.stop_requested()) ask_to_end();
      pollfd waiting{output_, POLLIN, 0};
      if (::poll(&waiting, 1, kMilliseconds) <= 0) {
        if (Clock::now() < latest_ || times_asked_ > 0) continue;
        was_late_ = true;
        ::kill(child_, SIGKILL);
        return std::nullopt;
      }
      std::array<char, 4096> bytes{};
      const ssize_t count = ::read(output_, bytes.data(), bytes.size());
      if (count < 0 && errno == EINTR) continue;
      if (count <= 0) return std::nullopt;
      text_.append(bytes.data(), static_cast<std::size_t>(count));
    }
    const std::size_t end = text_.find('\n');
    std::string found = text_.substr(0, end);
    text_.erase(0, end + 1);
    return found;
  }

  /// Whether it took longer than it may.
  bool was_late() const { return was_late_; }

  /// Waits until it has ended. @return its status, as `waitpid` gives it.
  int end() {
    int status = 0;
    while (::waitpid(child_, &status, 0) < 0 && errno == EINTR) {
    }
    child_ = 0;
    return status;
  }

 private:
  using Clock = std::chrono::steady_clock;

  void ask_to_end() {
    // Signals within a second count as one (interrupts.cpp).
    constexpr std::chrono::milliseconds kBetween{1200};
    constexpr int kMost = 2;
    if (times_asked_ == kMost || (times_asked_ > 0 && Clock::now() < asked_ + kBetween)) return;
    ++times_asked_;
    asked_ = Clock::now();
    ::kill(child_, SIGTERM);
  }

  [[noreturn]] static void fail(int code) {
    throw Error(fmt::format("no process can be started for the checks: {}", std::strerror(code)));
  }

  int output_ = -1;
  pid_t child_ = 0;
  Clock::time_point latest_ = Clock::time_point::max();
  Clock::time_point asked_;
  int times_asked_ = 0;
  bool was_late_ = false;
  std::string text_;
};

std::vector<std::string> command_for(const Device& device, const std::string& programs,
                                     std::size_t first) {
  std::vector<std::string> words = {
      "qjulia",        "doctor",
      "check",         "--quiet",
      "--device",      fmt::format("{}:{}", device.info().platform, device.info().index),
      "--layout",      to_string(device.layout()),
      "--checks-from", std::to_string(first)};
  if (!programs.empty()) words.insert(words.end(), {"--programs", programs});
  return words;
}

/// What one process reports, and how it ended.
struct Part {
  std::size_t begun = 0, done = 0;  ///< checks
  WaitTime waited;
  base::BuildTotal built;
  int status = 0;
  bool was_late = false;
};

void read_result(const nlohmann::json& line, ProcessChecks& all, Part& part) {
  ProgramCheck& check = all.report.checks.at(part.done);
  check.problem = line["problem"];
  check.is_built = line["built"];
  if (line["difference"].is_number()) check.difference = line["difference"];
  part.waited = {line["waited"][0], line["waited"][1], line["waited"][2]};
  part.built = {line["builds"][0], line["builds"][1], line["builds"][2], line["build_seconds"]};
  ++part.done;
}

Part run_part(const Device& device, const std::string& programs, std::size_t first,
              std::chrono::seconds most, ProcessChecks& all, Session& session) {
  using Clock = std::chrono::steady_clock;
  Part part{.begun = first, .done = first, .waited = {}, .built = {}};
  CheckProcess process(command_for(device, programs, first));
  Clock::time_point began;
  process.allow(most);
  const ProgressMonitor monitor = session.monitor();
  const auto count = static_cast<double>(all.report.checks.size());
  while (const auto text = process.line(monitor.stop)) {
    const nlohmann::json line = nlohmann::json::parse(*text, nullptr, false);
    if (!line.is_object()) continue;  // something that a driver says
    process.allow(most);
    if (line.contains("begin")) {
      ++part.begun;
      began = Clock::now();
      monitor.report({"checking", static_cast<double>(part.done) / count, -1,
                      all.report.checks.at(part.done).program});
    } else {
      all.seconds.at(part.done) = std::chrono::duration<double>(Clock::now() - began).count();
      read_result(line, all, part);
    }
  }
  part.was_late = process.was_late();
  part.status = process.end();
  throw_if_stopped(monitor.stop);
  return part;
}

void add(const Part& part, ProcessChecks& all) {
  all.waited.seconds += part.waited.seconds;
  all.waited.processor_seconds += part.waited.processor_seconds;
  all.waited.slept_seconds += part.waited.slept_seconds;
  all.built.compiled += part.built.compiled;
  all.built.loaded += part.built.loaded;
  all.built.replaced += part.built.replaced;
  all.built.seconds += part.built.seconds;
}

/// To standard output at once, on a line of its own: a driver may have left one unfinished.
/// @return false where nobody reads it.
bool say_line(const nlohmann::json& line) {
  const std::string text =
      '\n' + line.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace) + '\n';
  return ::write(STDOUT_FILENO, text.data(), text.size()) == static_cast<ssize_t>(text.size());
}

}  // namespace

std::vector<std::size_t> chosen_checks(const Device& device, const std::string& programs) {
  const auto plan = self_test_plan(device);
  const auto names = base::split(programs, ',');
  std::vector<std::size_t> chosen;
  for (std::size_t i = 0; i < plan.size(); ++i) {
    const bool is_named = std::ranges::any_of(names, [&](const std::string& name) {
      return ::fnmatch(name.c_str(), plan[i].program.c_str(), 0) == 0;
    });
    if (programs.empty() || is_named) chosen.push_back(i);
  }
  if (chosen.empty()) {
    throw OptionError(
        "programs",
        fmt::format("no check has a name like '{}'; give names such as 'energy.cl' or 'gradient*'",
                    programs));
  }
  return chosen;
}

ProcessChecks check_here(const Device& device, const std::string& programs,
                         const ProgressMonitor& monitor) {
  using Clock = std::chrono::steady_clock;
  ProcessChecks all{{device.info(), device.layout(), {}}, {}, {}, {}, {}};
  const auto plan = self_test_plan(device);
  const auto chosen = chosen_checks(device, programs);
  for (const std::size_t number : chosen) {
    throw_if_stopped(monitor.stop);
    const auto done = static_cast<double>(all.report.checks.size());
    monitor.report(
        {"checking", done / static_cast<double>(chosen.size()), -1, plan[number].program});
    const Clock::time_point began = Clock::now();
    all.report.checks.push_back(self_test_check(device, number));
    all.seconds.push_back(std::chrono::duration<double>(Clock::now() - began).count());
  }
  all.waited = device.wait_time();
  all.built = base::build_total();
  all.signals.resize(chosen.size());
  return all;
}

ProcessChecks check_in_processes(const Device& device, const std::string& programs,
                                 std::chrono::seconds most, Session& session) {
  ProcessChecks all{{device.info(), device.layout(), {}}, {}, {}, {}, {}};
  auto& checks = all.report.checks;
  const auto plan = self_test_plan(device);
  for (const std::size_t number : chosen_checks(device, programs)) checks.push_back(plan[number]);
  all.signals.resize(checks.size());
  all.seconds.resize(checks.size());
  // That is what the user asks for here.
  ::setenv("QJULIA_CRASHED_BUILDS", "retry", 0);
  for (std::size_t next = 0; next < checks.size();) {
    const Part part = run_part(device, programs, next, most, all, session);
    add(part, all);
    next = part.done;
    if (next == checks.size()) break;
    const int signal = WIFSIGNALED(part.status) ? WTERMSIG(part.status) : 0;
    const bool was_late = part.was_late && signal == SIGKILL;
    const std::string late = fmt::format("it took longer than {} s", most.count());
    if (part.begun == part.done) {
      throw Error(fmt::format("the process that runs the checks ended before {} ({})",
                              checks[next].program,
                              was_late      ? late
                              : signal != 0 ? ::strsignal(signal)
                                            : "see above"));
    }
    if (was_late) {
      checks[next].problem = "the driver hangs: " + late + ", and the process was ended";
    } else if (signal != 0) {
      all.signals[next] = signal;
      checks[next].problem =
          fmt::format("the driver crashed with signal {} ({})", signal, ::strsignal(signal));
    } else {
      checks[next].problem =
          fmt::format("the driver ended the process with exit code {}", WEXITSTATUS(part.status));
    }
    ++next;
  }
  return all;
}

int run_checks(const DeviceChoice& wanted, const std::string& programs, int first,
               Session& session) {
  const Device device = with_cached_tuning(Device::choose(wanted)).device;
  const auto chosen = chosen_checks(device, programs);
  for (std::size_t i = static_cast<std::size_t>(first); i < chosen.size(); ++i) {
    throw_if_stopped(session.stop());
    if (!say_line({{"begin", i}})) return kFailed;
    const ProgramCheck check = self_test_check(device, chosen[i]);
    nlohmann::json line{
        {"problem", check.problem}, {"built", check.is_built}, {"difference", nullptr}};
    if (std::isfinite(check.difference)) line["difference"] = check.difference;
    const WaitTime waited = device.wait_time();
    line["waited"] = {waited.seconds, waited.processor_seconds, waited.slept_seconds};
    const base::BuildTotal built = base::build_total();
    line["builds"] = {built.compiled, built.loaded, built.replaced};
    line["build_seconds"] = built.seconds;
    if (!say_line(line)) return kFailed;
  }
  return kDone;
}

std::string describe(const base::BuildTotal& built) {
  std::string text = fmt::format("compiled {} programs", built.compiled);
  if (built.loaded > 0) text += fmt::format(" and loaded {} that were kept", built.loaded);
  if (built.replaced > 0) {
    text += fmt::format(" ({} took the place of files that did not load)", built.replaced);
  }
  return text + fmt::format(", in {:.3f} s", built.seconds);
}

}  // namespace qjulia::tools
