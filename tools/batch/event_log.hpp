#pragma once
/// What happens in a batch, for programs that watch it.

#include <chrono>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "batch/batch.hpp"

namespace qjulia::batch {

/// A file with an object of JSON a line, each written when it happens. Several processes may write
/// into one file.
class EventLog {
 public:
  /// @param keep what is in the file. @throws OutputError
  EventLog(const std::filesystem::path& file, bool keep, int rank);
  ~EventLog();
  EventLog(const EventLog&) = delete;
  EventLog& operator=(const EventLog&) = delete;

  /// Progress of an entry at most once a second; nothing of what other ranks tell themselves.
  void write(const BatchEvent& event);
  /// An event of the batch itself.
  void write(const std::string& event, nlohmann::json members);
  /// Whether a line could not be written.
  bool has_failed() const { return has_failed_; }

 private:
  int file_;
  int rank_;
  bool has_failed_ = false;
  std::map<std::string, std::chrono::steady_clock::time_point> last_;  ///< progress, by entry
};

/// An entry as one rank knows it.
struct KnownEntry {
  EntryStatus status;
  bool elsewhere = false;  ///< BatchEvent::elsewhere: only its state is known
};

/// The batch as metrics in Prometheus's text format, for the textfile collector of a node exporter.
class MetricsFile {
 public:
  MetricsFile(std::filesystem::path file, std::size_t entries, std::optional<Shard> shard);

  /// Writes the file at most every two seconds. @throws OutputError
  void note(const BatchEvent& event);
  /// @throws OutputError
  void write();

 private:
  std::filesystem::path file_;
  std::size_t entries_;
  std::optional<Shard> shard_;
  std::map<std::string, KnownEntry> known_;
  std::chrono::steady_clock::time_point written_;
};

/// @param entries those that are known. @param all of the batch. @param time Unix time, seconds.
/// @param shard in every metric's labels.
std::string metrics_text(const std::map<std::string, KnownEntry>& entries, std::size_t all,
                         double time, const std::optional<Shard>& shard);

}  // namespace qjulia::batch
