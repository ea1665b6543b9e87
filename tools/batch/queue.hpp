#pragma once
/// Which entry is next, for the threads of all ranks of a batch.

#include <chrono>
#include <condition_variable>
#include <exception>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <stop_token>
#include <vector>

#include "batch/batch.hpp"
#include "batch/entry_keys.hpp"
#include "batch/round.hpp"

namespace qjulia::batch {

/// An entry that is done or has failed.
struct Settled {
  EntryStatus status;  ///< another rank's has its name and state alone
  enum class By { earlier_run, this_rank, other_rank } by;
};

/// A rank that was given up, and the entries that are open again.
struct LostRank {
  std::size_t rank = 0;
  std::vector<std::string> entries;
};

/// The entries' list. Every rank has the same one: what threads ask for and what they have settled
/// goes round all ranks, and each replays it in the same order.
class Queue {
 public:
  /// @param runners threads of this rank that take entries.
  /// @param observe_settled is called with every entry that is settled, in the same order on all
  /// ranks.
  /// @param observe_lost is called with every rank that is given up.
  Queue(const Manifest& manifest, const BatchOptions& options, BatchRanks* ranks,
        std::size_t runners, std::function<void(const Settled&)> observe_settled,
        std::function<void(const LostRank&)> observe_lost = {});

  /// The next entry, this runner's alone until it is put back. An entry that follows
  /// another is handed out once that one is settled. Waits while entries are in other hands, which
  /// may give them back. Nothing when all are settled, a stop is requested, or `run`
  /// has failed.
  /// @param last_choice entries taken only when there are no others.
  std::optional<std::size_t> next(std::size_t runner, const std::set<std::size_t>& last_choice,
                                  const std::stop_token& stop);

  /// Writes the status down and hands the entry on: settled when done or failed, else open again.
  void put_back(std::size_t runner, std::size_t index, const EntryStatus& status);

  /// Waits until this rank has sent a message so recently that the others cannot have given it up:
  /// a process that was stopped, and goes on, must not write over what others have done
  /// meanwhile. Runners call it before each file gets its name; a stop between this and the file's
  /// new name, some microseconds, stays unnoticed.
  /// @throws Error where this rank is given up, or rank 0 is lost.
  void expect_own_entries();

  /// A runner takes no more entries; one that it still has is open again.
  void leave(std::size_t runner) noexcept;

  /// Goes round the ranks until no runner is left on any. For the thread that may call `ranks`.
  /// When it throws, runners end.
  void run();

  /// The entry's key, as its mesh is now. @throws what `BatchOptions::key` throws
  FitKey key_of(std::size_t index) { return keys_.of(index); }

  /// Whether the entry that this one follows has a map; true where it follows none.
  bool has_start(std::size_t index) const;

  /// Entries whose last state could not be written.
  std::vector<EntryStatus> unsaved() const;

 private:
  enum class Place { open, taken, settled };
  using Messages = std::vector<std::optional<RoundMessage>>;  ///< by rank; none of lost ranks
  struct Request {
    std::set<std::size_t> last_choice;
    std::optional<std::size_t> answer;
  };

  /// This rank's message for the next round. Waits until it has something to say, or others have
  /// waited long enough.
  RoundMessage message();
  Messages exchange(const RoundMessage& mine);
  /// @param sent when this rank sent its own message, by the clock of `since_boot`
  void replay(const Messages& messages, std::chrono::nanoseconds sent);
  /// Opens the entries of a rank that is lost for the first time.
  std::optional<LostRank> give_up(std::size_t rank);
  /// Notes the places of entries that a rank has put back. @return those that are settled.
  std::vector<Settled> place_back(std::size_t rank, const RoundMessage& message);
  /// Gives entries to those of a rank's runners that wait for one.
  void hand_out(std::size_t rank, const RoundMessage& message);
  /// An open entry of those that are the runner's last choice, or of the others.
  std::optional<std::size_t> choose(const std::set<std::size_t>& last_choice, bool last) const;
  std::optional<EntryStatus> settled_status(std::size_t index);
  void tell();
  void look_at_earlier(const std::stop_token& stop);
  void settle_earlier(const std::stop_token& stop);
  bool is_heard() const;
  bool all_settled() const;

  const Manifest& manifest_;
  const BatchOptions& options_;
  BatchRanks* ranks_;  ///< null: this process alone
  std::size_t rank_;
  std::function<void(const Settled&)> observe_settled_;
  std::function<void(const LostRank&)> observe_lost_;
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;  ///< for runners: answers, or that all is settled
  std::condition_variable_any news_;     ///< for `run`: there is something to tell
  bool has_news_ = false;
  EntryKeys keys_;
  std::vector<Place> places_;
  std::set<std::size_t> failed_;                  ///< of those that are settled
  std::map<std::size_t, std::size_t> takers_;     ///< the ranks that have what is taken, by entry
  std::set<std::size_t> lost_;                    ///< ranks
  std::set<std::size_t> ready_;                   ///< ranks: see `RoundMessage::is_ready`
  bool is_ready_;                                 ///< this rank
  std::exception_ptr not_ready_;                  ///< why it will never be
  std::chrono::nanoseconds last_sent_{};          ///< `sent` of the last round
  std::map<std::size_t, Request> requests_;       ///< by runner
  std::vector<std::optional<std::size_t>> held_;  ///< entries, by runner
  bool has_failed_ = false;                       ///< `run` has
  std::vector<RoundMessage::PutBack> put_back_;   ///< since the last round
  std::map<std::size_t, Settled> settled_here_;   ///< by entry, until observed
  std::size_t runners_;                           ///< that have not left
  std::vector<EntryStatus> unsaved_;
};

}  // namespace qjulia::batch
