#pragma once
/// The messages that the ranks of a batch exchange in a round of its queue.

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

  std::size_t runners = 0;  ///< how many of the rank's runners have not left
  std::vector<PutBack> put_back;
  std::vector<Request> requests;
  bool operator==(const RoundMessage&) const = default;
};

/// The message as bytes, in CBOR with members by name.
std::string packed(const RoundMessage& message);

/// @throws Error if the bytes are not such a message; another version of the program may send them.
RoundMessage unpacked(const std::string& bytes);

}  // namespace qjulia::batch
