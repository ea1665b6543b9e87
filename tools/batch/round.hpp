#pragma once
/// The messages that the ranks of a batch exchange in a round of its queue.

#include <chrono>
#include <cstddef>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "batch/batch.hpp"

namespace qjulia::batch {

/// Processes that run a batch together, each with the same list of entries.
class BatchRanks {
 public:
  virtual ~BatchRanks() = default;
  virtual int rank() const = 0;  ///< 0 … size − 1
  virtual int size() const = 0;
  /// What every rank gives, by rank, on every rank; nothing of a rank that is lost: one that has
  /// not called this for so long that the others have given it up. It stays lost.
  /// @throws Error on a rank that was given up itself, and where rank 0 is lost.
  virtual std::vector<std::optional<std::string>> exchange(const std::string& mine) = 0;
  /// The shortest silence after which a rank is given up.
  virtual std::chrono::milliseconds patience() const = 0;

 protected:
  BatchRanks() = default;
  BatchRanks(const BatchRanks&) = default;
  BatchRanks& operator=(const BatchRanks&) = default;
};

/// One rank's message.
struct RoundMessage {
  /// An entry that is in no runner's hands any more.
  struct PutBack {
    std::size_t entry = 0;  ///< its place in the manifest
    EntryState state = EntryState::waiting;
    bool operator==(const PutBack&) const = default;
  };
  /// A runner that waits for an entry.
  struct Request {
    std::size_t runner = 0;             ///< its number on its rank
    std::set<std::size_t> last_choice;  ///< entries it takes only when there are no others
    bool operator==(const Request&) const = default;
  };

  std::size_t runners = 0;  ///< how many of the rank's runners have not left
  bool is_ready = false;    ///< it has looked through its share of what an earlier run has done
  std::vector<PutBack> put_back;
  std::vector<Request> requests;
  bool operator==(const RoundMessage&) const = default;
};

/// The message as bytes, in CBOR with members by name.
std::string packed(const RoundMessage& message);

/// @throws Error if the bytes are not such a message; another version of the program may send them.
RoundMessage unpacked(const std::string& bytes);

}  // namespace qjulia::batch
