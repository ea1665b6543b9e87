#pragma once
/// Progress on standard error: a bar with the time left on a terminal, now and then a line
/// elsewhere.

#include <chrono>
#include <string>

#include "qjulia/progress.hpp"

namespace qjulia::tools {

class ProgressDisplay {
 public:
  ProgressDisplay();
  void show(const Progress& progress);
  /// Removes the bar, so that other text can be written in its place.
  void clear();

 private:
  using Clock = std::chrono::steady_clock;
  bool terminal_;
  bool drawn_ = false;
  std::string activity_;
  Clock::time_point last_;
};

/// "0:12" or "1:02:03".
std::string clock_time(double seconds);

/// Of standard error; 80 when it is no terminal.
std::size_t terminal_columns();

/// "43 %, 0:12 left, E -0.97": everything of a moment but its activity.
std::string describe(const Progress& progress);

/// The bar and its text, cut to `columns` characters.
std::string bar_line(const Progress& progress, std::size_t columns);

}  // namespace qjulia::tools
