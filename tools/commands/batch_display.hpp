#pragma once
/// A batch as it goes: a table that stays in place on a terminal, plain lines elsewhere.

#include <chrono>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "batch/batch.hpp"
#include "console/console.hpp"

namespace qjulia::tools {

class BatchDisplay {
 public:
  /// @param entries of the whole batch.
  BatchDisplay(Console& console, std::size_t entries);
  ~BatchDisplay();
  BatchDisplay(const BatchDisplay&) = delete;
  BatchDisplay& operator=(const BatchDisplay&) = delete;

  /// Called by one thread at a time.
  void show(const batch::BatchEvent& event);

 private:
  void count(const batch::BatchEvent& event);
  void draw_table();
  void clear_table();
  std::string header() const;

  using Clock = std::chrono::steady_clock;
  Console& console_;
  std::size_t entries_;
  bool table_;
  Clock::time_point start_ = Clock::now();
  Clock::time_point last_drawn_;
  std::size_t rows_drawn_ = 0;
  std::size_t done_ = 0;
  std::size_t failed_ = 0;
  std::size_t earlier_ = 0;
  std::map<std::string, Progress> running_;  ///< by entry
};

/// One line on where an entry stands: "done  bunny  4.1 s, energy 1e-4, IoU 0.98".
std::string describe(const batch::EntryStatus& status);

std::size_t count(const std::vector<batch::EntryStatus>& entries, batch::EntryState state);
/// "3 of 5 done, 2 failed".
std::string totals(const std::vector<batch::EntryStatus>& entries);
nlohmann::json report_json(const std::vector<batch::EntryStatus>& entries);
/// kDone once every entry is done.
int batch_exit_code(const std::vector<batch::EntryStatus>& entries);

}  // namespace qjulia::tools
