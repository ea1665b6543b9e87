#include "console/child_output.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "qjulia/base/error.hpp"
#include "qjulia/base/progress.hpp"

namespace qjulia::tools {
namespace {

/// A pipe whose ends are closed when it goes.
struct Pipe {
  std::array<int, 2> ends{-1, -1};

  Pipe() {
    if (::pipe2(ends.data(), O_CLOEXEC) != 0) {
      throw Error(fmt::format("cannot make a pipe: {}", std::strerror(errno)));
    }
  }
  ~Pipe() { close(0), close(1); }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  void close(std::size_t end) {
    if (ends[end] >= 0) ::close(ends[end]);
    ends[end] = -1;
  }
};

/// "NAME=VALUE" of all variables, with these in place of those of the same names.
std::vector<std::string> environment_with(const std::map<std::string, std::string>& changes) {
  std::vector<std::string> all;
  for (char** entry = environ; *entry != nullptr; ++entry) {
    const std::string text = *entry;
    if (!changes.contains(text.substr(0, text.find('=')))) all.push_back(text);
  }
  for (const auto& [name, value] : changes) all.push_back(fmt::format("{}={}", name, value));
  return all;
}

/// For the system: pointers to the texts, and null.
std::vector<char*> pointers(std::vector<std::string>& texts) {
  std::vector<char*> list;
  list.reserve(texts.size() + 1);
  for (std::string& text : texts) list.push_back(text.data());
  list.push_back(nullptr);
  return list;
}

pid_t started(std::vector<std::string> words, std::vector<std::string> environment, const Pipe& out,
              const Pipe& err) {
  const std::vector<char*> list = pointers(words), variables = pointers(environment);
  posix_spawn_file_actions_t actions;
  posix_spawnattr_t attributes;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_adddup2(&actions, out.ends[1], STDOUT_FILENO);
  ::posix_spawn_file_actions_adddup2(&actions, err.ends[1], STDERR_FILENO);
  ::posix_spawnattr_init(&attributes);
  sigset_t none;
  ::sigemptyset(&none);
  ::posix_spawnattr_setsigmask(&attributes, &none);  // this process blocks some
  ::posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK);
  pid_t child = 0;
  const int code =
      ::posix_spawnp(&child, list.front(), &actions, &attributes, list.data(), variables.data());
  ::posix_spawnattr_destroy(&attributes);
  ::posix_spawn_file_actions_destroy(&actions);
  if (code != 0) {
    throw InputError(fmt::format("cannot run '{}': {}", words.front(), std::strerror(code)));
  }
  return child;
}

/// Appends what is there. @return whether more may come.
bool read_some(int file, std::string& text) {
  std::array<char, 65536> bytes;
  const ssize_t count = ::read(file, bytes.data(), bytes.size());
  if (count > 0) text.append(bytes.data(), static_cast<std::size_t>(count));
  return count > 0 || (count < 0 && errno == EINTR);
}

}  // namespace

ChildOutput child_output(const std::vector<std::string>& words, const std::stop_token& stop,
                         const std::map<std::string, std::string>& environment) {
  Pipe out, err;
  const pid_t child = started(words, environment_with(environment), out, err);
  out.close(1), err.close(1);
  ChildOutput result;
  constexpr int kBetweenLooks = 100;  // milliseconds
  bool is_ended = false;
  while (out.ends[0] >= 0 || err.ends[0] >= 0) {
    if (stop.stop_requested() && !is_ended) {
      ::kill(child, SIGTERM);
      is_ended = true;
    }
    std::array<pollfd, 2> files{{{out.ends[0], POLLIN, 0}, {err.ends[0], POLLIN, 0}}};
    if (::poll(files.data(), files.size(), kBetweenLooks) <= 0) continue;
    if (files[0].revents != 0 && !read_some(out.ends[0], result.out)) out.close(0);
    if (files[1].revents != 0 && !read_some(err.ends[0], result.err)) err.close(0);
  }
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  throw_if_stopped(stop);
  constexpr int kSignalled = 128;
  if (WIFSIGNALED(status)) result.signal = WTERMSIG(status);
  result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : kSignalled + result.signal;
  return result;
}

}  // namespace qjulia::tools
