#pragma once
/// Where the command's words go: results to standard output, everything else to standard error.
/// Printing never throws and never ends the process: what a command has made is worth more than
/// what it says about it.

#include <chrono>
#include <mutex>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "qjulia/base/progress.hpp"

namespace qjulia::tools {

/// How much a command says.
struct Verbosity {
  bool quiet = false;    ///< only results, warnings and errors
  bool verbose = false;  ///< also where the time went
  bool json = false;     ///< the result as one JSON object
};

/// What a command says where nobody reads its words as they come.
struct Said {
  nlohmann::json report{};  ///< the result; null: it has none
  std::vector<std::string> notes{}, warnings{};
};

/// Progress on standard error: a bar with the time left on a terminal, a line now and then
/// elsewhere.
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

/// Threads may note, warn and show progress at the same time.
class Console {
 public:
  explicit Console(const Verbosity& verbosity) : verbosity_(verbosity) {}
  /// Keeps what is said instead of printing it; progress is not kept.
  explicit Console(Said& said) : said_(&said) {}
  ~Console() { display_.clear(); }
  Console(const Console&) = delete;
  Console& operator=(const Console&) = delete;

  bool quiet() const { return verbosity_.quiet; }
  bool verbose() const { return verbosity_.verbose; }
  bool json() const { return verbosity_.json; }

  /// What happens, unless quiet.
  void note(const std::string& text);
  /// Only when verbose.
  void detail(const std::string& text);
  /// Once for each text.
  void warn(const std::string& text);
  /// The result: `text` for people or `object` for programs, on standard output.
  void result(const std::string& text, const nlohmann::json& object);
  /// The same for commands whose result is a file: `text` says so on standard error, unless quiet.
  void summary(const std::string& text, const nlohmann::json& object);
  void progress(const Progress& progress);
  /// Whether standard output did not take a result.
  bool is_result_lost() const { return is_result_lost_; }

 private:
  void print(const std::string& text);

  Verbosity verbosity_;
  Said* said_ = nullptr;
  std::mutex speaking_;
  ProgressDisplay display_;
  std::set<std::string> warnings_;
  bool is_result_lost_ = false;
};

/// Call it first. Files that are opened later do not get the number of a stream that was closed,
/// and a reader that goes away does not end the process.
void prepare_standard_streams();

/// Writes text and a line's end to standard output; where that fails, says so on standard error.
/// @return false where the text is lost, unless its reader has closed the pipe on purpose
bool print_result(const std::string& text);

/// To standard error, as it stands.
void print_error(const std::string& text);

/// "0:12" or "1:02:03".
std::string clock_time(double seconds);

/// The width of standard error in columns; 80 when it is no terminal.
std::size_t terminal_columns();

/// "43 %, 0:12 left, E -0.97": everything of a moment but its activity.
std::string describe(const Progress& progress);

/// The bar and its text, cut to `columns` characters.
std::string bar_line(const Progress& progress, std::size_t columns);

}  // namespace qjulia::tools
