#include "process.hpp"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <filesystem>
#include <stdexcept>

namespace qjulia::test {
namespace {

struct Pipe {
  int read_end = -1;
  int write_end = -1;
  Pipe() {
    std::array<int, 2> ends{};
    if (::pipe2(ends.data(), O_CLOEXEC) != 0) throw std::runtime_error("pipe2 failed");
    read_end = ends[0];
    write_end = ends[1];
  }
  ~Pipe() {
    close_write();
    ::close(read_end);
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  void close_write() {
    if (write_end >= 0) ::close(write_end);
    write_end = -1;
  }
};

std::vector<std::string> environment_with(const std::map<std::string, std::string>& changes) {
  std::vector<std::string> result;
  for (char** entry = environ; *entry != nullptr; ++entry) {
    const std::string text = *entry;
    if (!changes.contains(text.substr(0, text.find('=')))) result.push_back(text);
  }
  for (const auto& [name, value] : changes) result.push_back(name + '=' + value);
  return result;
}

std::vector<char*> pointers(std::vector<std::string>& strings) {
  std::vector<char*> result;
  for (std::string& s : strings) result.push_back(s.data());
  result.push_back(nullptr);
  return result;
}

pid_t spawn(std::vector<std::string> command, std::vector<std::string> environment, const Pipe& out,
            const Pipe& err) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, out.write_end, STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, err.write_end, STDERR_FILENO);
  pid_t child = -1;
  const int error = posix_spawn(&child, command.front().c_str(), &actions, nullptr,
                                pointers(command).data(), pointers(environment).data());
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0) throw std::runtime_error("cannot start " + command.front());
  return child;
}

}  // namespace

ProcessResult run(const std::vector<std::string>& command, const RunOptions& options) {
  Pipe out;
  Pipe err;
  const pid_t child = spawn(command, environment_with(options.environment), out, err);
  out.close_write();
  err.close_write();

  ProcessResult result;
  const auto end = std::chrono::steady_clock::now() + options.timeout;
  std::array<pollfd, 2> watched{pollfd{out.read_end, POLLIN, 0}, pollfd{err.read_end, POLLIN, 0}};
  while (watched[0].fd >= 0 || watched[1].fd >= 0) {
    if (!result.timed_out && std::chrono::steady_clock::now() > end) {
      result.timed_out = true;
      ::kill(child, SIGKILL);
    }
    ::poll(watched.data(), watched.size(), options.kill_once.empty() ? 100 : 5);
    for (pollfd& stream : watched) {
      if (stream.fd < 0 || stream.revents == 0) continue;
      std::array<char, 4096> block{};
      const ssize_t count = ::read(stream.fd, block.data(), block.size());
      if (count <= 0) {
        stream.fd = -1;
        continue;
      }
      std::string& text = &stream == watched.data() ? result.out : result.err;
      text.append(block.data(), static_cast<std::size_t>(count));
    }
    if (!result.interrupted && !options.interrupt_at.empty() &&
        result.err.find(options.interrupt_at) != std::string::npos) {
      result.interrupted = true;
      ::kill(child, options.interrupt_by);
    }
    if (!options.kill_once.empty() && std::filesystem::exists(options.kill_once)) {
      ::kill(child, SIGKILL);
    }
    if (!options.kill_at.empty() && result.err.find(options.kill_at) != std::string::npos) {
      ::kill(child, SIGKILL);
    }
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return result;
}

ProcessResult run_command(std::vector<std::string> arguments, const RunOptions& options) {
  arguments.insert(arguments.begin(), QJULIA_COMMAND);
  return run(arguments, options);
}

}  // namespace qjulia::test
