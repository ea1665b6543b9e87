#include "console/console.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <nlohmann/json.hpp>

namespace qjulia::tools {
namespace {

constexpr std::chrono::milliseconds kBetweenBars{100}, kBetweenLines{5000};

/// The first `count` characters of UTF-8 text.
std::string cut(const std::string& text, std::size_t count) {
  std::size_t characters = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool continues = (static_cast<unsigned char>(text[i]) & 0xC0U) == 0x80U;
    if (!continues && characters++ == count) return text.substr(0, i);
  }
  return text;
}

double bounded(double fraction) {
  return std::isfinite(fraction) ? std::clamp(fraction, 0.0, 1.0) : 0.0;
}

std::string dump(const nlohmann::json& object) {
  // File names need not be UTF-8.
  return object.dump(2, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace

void Console::note(const std::string& text) {
  const std::lock_guard lock(speaking_);
  if (said_ != nullptr) return said_->notes.push_back(text);
  if (verbosity_.quiet) return;
  display_.clear();
  print_error(text + '\n');
}

void Console::detail(const std::string& text) {
  if (verbosity_.verbose) note(text);
}

void Console::warn(const std::string& text) {
  const std::lock_guard lock(speaking_);
  if (!warnings_.insert(text).second) return;
  if (said_ != nullptr) return said_->warnings.push_back(text);
  display_.clear();
  print_error("warning: " + text + '\n');
}

void Console::result(const std::string& text, const nlohmann::json& object) {
  if (said_ != nullptr) {
    said_->report = object;
    return;
  }
  display_.clear();
  print(verbosity_.json ? dump(object) : text);
}

void Console::summary(const std::string& text, const nlohmann::json& object) {
  note(text);
  if (said_ != nullptr) {
    said_->report = object;
    return;
  }
  if (verbosity_.json) print(dump(object));
}

void Console::print(const std::string& text) {
  if (!print_result(text)) is_result_lost_ = true;
}

void Console::progress(const Progress& progress) {
  const std::lock_guard lock(speaking_);
  if (said_ == nullptr && !verbosity_.quiet) display_.show(progress);
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

bool print_result(const std::string& text) {
  const bool is_written = std::fwrite(text.data(), 1, text.size(), stdout) == text.size() &&
                          std::fputc('\n', stdout) != EOF && std::fflush(stdout) == 0;
  // A pipe's reader, such as `head`, may have had enough.
  if (is_written || errno == EPIPE) return true;
  print_error(fmt::format("qjulia: cannot write to standard output: {}\n", std::strerror(errno)));
  return false;
}

void print_error(const std::string& text) {
  std::fwrite(text.data(), 1, text.size(), stderr);
  std::fflush(stderr);
}

std::string clock_time(double seconds) {
  const auto whole = static_cast<long>(std::lround(std::min(seconds, 1e7)));
  if (whole < 3600) return fmt::format("{}:{:02}", whole / 60, whole % 60);
  return fmt::format("{}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60);
}

std::size_t terminal_columns() {
  winsize size{};
  if (::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return 80;
  return size.ws_col;
}

std::string describe(const Progress& progress) {
  std::string text = fmt::format("{:3.0f} %", 100 * bounded(progress.fraction));
  if (progress.seconds_left >= 0 && std::isfinite(progress.seconds_left)) {
    text += fmt::format(", {} left", clock_time(progress.seconds_left));
  }
  if (!progress.detail.empty()) text += ", " + progress.detail;
  return text;
}

std::string bar_line(const Progress& progress, std::size_t columns) {
  constexpr std::size_t kBar = 24;
  const auto filled = static_cast<std::size_t>(std::lround(bounded(progress.fraction) * kBar));
  const std::string line = fmt::format("{} [{}{}] {}", progress.activity, std::string(filled, '#'),
                                       std::string(kBar - filled, '.'), describe(progress));
  return cut(line, columns);
}

ProgressDisplay::ProgressDisplay() : terminal_(::isatty(STDERR_FILENO) == 1) {}

void ProgressDisplay::show(const Progress& progress) {
  const auto now = Clock::now();
  const bool changed = progress.activity != activity_;
  if (!changed && now - last_ < (terminal_ ? kBetweenBars : kBetweenLines)) return;
  activity_ = progress.activity;
  last_ = now;
  if (terminal_) {
    // One column stays free: a full line would wrap on some terminals.
    print_error("\r\x1b[K" + bar_line(progress, terminal_columns() - 1));
    drawn_ = true;
  } else {
    print_error(fmt::format("{}: {}\n", progress.activity, describe(progress)));
  }
}

void ProgressDisplay::clear() {
  if (!drawn_) return;
  print_error("\r\x1b[K");
  drawn_ = false;
}

}  // namespace qjulia::tools
