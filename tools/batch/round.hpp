#pragma once
/// What the ranks of a batch tell each other in a round of its queue.

#include <cstddef>
#include <set>
#include <string>
#include <vector>

#include "batch/batch.hpp"

namespace qjulia::batch {

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

  std::size_t runners = 0;  ///< of the rank, that have not left
  std::vector<PutBack> put_back;
  std::vector<Request> requests;
  bool operator==(const RoundMessage&) const = default;
};

/// The message as bytes: CBOR, each member by its name.
std::string packed(const RoundMessage& message);

/// @throws Error when the bytes are no such message, as from another version of the program.
RoundMessage unpacked(const std::string& bytes);

}  // namespace qjulia::batch
