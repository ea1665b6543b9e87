#pragma once
/// Which entry is next, for the threads of one process among others that share the folder.

#include <condition_variable>
#include <list>
#include <mutex>
#include <optional>
#include <set>
#include <stop_token>
#include <vector>

#include "batch/claim.hpp"
#include "qjulia/batch.hpp"

namespace qjulia::batch {

/// An entry that is this thread's alone until it is settled or given back.
struct Task {
  std::size_t index = 0;
  EntryStatus status;  ///< with its key, and what was tried before
};

class Queue {
 public:
  Queue(const Manifest& manifest, const BatchOptions& options,
        std::function<void(const EntryStatus&)> settled_before);

  /// The next entry, claimed. Waits while entries are in other hands, which may give them back.
  /// Nothing when all are settled or a stop is requested.
  /// @param last_choice entries taken only when there are no others.
  std::optional<Task> next(const std::set<std::size_t>& last_choice, const std::stop_token& stop);

  /// Writes the status down and ends the claim; the entry is settled when done or failed.
  void put_back(const EntryStatus& status, std::size_t index);

  /// Shows processes elsewhere that those claimed here are alive.
  void touch_claims();

  /// Entries whose last state could not be written.
  std::vector<EntryStatus> unsaved() const;

 private:
  enum class Place { open, here, elsewhere, settled };

  std::optional<std::size_t> claim_any(const std::set<std::size_t>& last_choice);
  bool claim(std::size_t index);
  void look_elsewhere();
  std::optional<EntryStatus> settled_status(std::size_t index, Task& task) const;
  bool all_settled() const;

  const Manifest& manifest_;
  const BatchOptions& options_;
  std::function<void(const EntryStatus&)> settled_before_;
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::vector<Place> places_;
  std::vector<std::optional<Claim>> claims_;
  std::vector<EntryStatus> unsaved_;
};

}  // namespace qjulia::batch
