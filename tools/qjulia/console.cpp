#include "console.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <nlohmann/json.hpp>

namespace qjulia::tools {
namespace {

std::string dump(const nlohmann::json& object) {
  // File names need not be UTF-8.
  return object.dump(2, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace

void Console::note(const std::string& text) {
  if (verbosity_.quiet) return;
  display_.clear();
  print_error(text + '\n');
}

void Console::detail(const std::string& text) {
  if (verbosity_.verbose) note(text);
}

void Console::warn(const std::string& text) {
  display_.clear();
  print_error("warning: " + text + '\n');
}

void Console::result(const std::string& text, const nlohmann::json& object) {
  display_.clear();
  print(verbosity_.json ? dump(object) : text);
}

void Console::summary(const std::string& text, const nlohmann::json& object) {
  note(text);
  if (verbosity_.json) print(dump(object));
}

void Console::print(const std::string& text) {
  if (print_result(text)) return;
  is_result_lost_ = true;
  print_error("qjulia: cannot write to standard output\n");
}

void Console::progress(const Progress& progress) {
  if (!verbosity_.quiet) display_.show(progress);
}

void prepare_standard_streams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(stream, F_GETFD) != -1) continue;
    // The lowest free number is this one. Standard output's result is missed, and writing fails.
    [[maybe_unused]] const int file =
        ::open("/dev/null", stream == STDERR_FILENO ? O_WRONLY : O_RDONLY);
  }
  // Writing fails instead, and says which file.
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
}

void print_error(const std::string& text) {
  std::fwrite(text.data(), 1, text.size(), stderr);
  std::fflush(stderr);
}

bool print_result(const std::string& text) {
  const bool written = std::fwrite(text.data(), 1, text.size(), stdout) == text.size() &&
                       std::fputc('\n', stdout) != EOF && std::fflush(stdout) == 0;
  return written || errno == EPIPE;
}

}  // namespace qjulia::tools
