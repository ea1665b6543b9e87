#include "progress_display.hpp"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>

#include "console.hpp"

namespace qjulia::tools {
namespace {

constexpr std::chrono::milliseconds kBetweenBars{100};
constexpr std::chrono::seconds kBetweenLines{5};

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

}  // namespace

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
  const Clock::duration pause =
      terminal_ ? Clock::duration(kBetweenBars) : Clock::duration(kBetweenLines);
  if (!changed && now - last_ < pause) return;
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
