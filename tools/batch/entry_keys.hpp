#pragma once
/// Keys of a manifest's entries, of which some follow others.

#include <cstddef>
#include <map>
#include <mutex>
#include <optional>
#include <vector>

#include "batch/batch.hpp"

namespace qjulia::batch {

/// The result of an entry that follows another depends on the meshes of all entries before it, and
/// so does its key. Threads may share it.
class EntryKeys {
 public:
  /// Both must outlive it.
  EntryKeys(const Manifest& manifest, const BatchOptions& options);

  /// The entry that this one follows.
  std::optional<std::size_t> before(std::size_t index) const { return before_[index]; }

  /// The key, with the entry's own mesh as it is now. @throws what `BatchOptions::key` throws
  FitKey of(std::size_t index);

 private:
  std::optional<FitKey> known(std::size_t index) const;

  const Manifest& manifest_;
  const BatchOptions& options_;
  std::vector<std::optional<std::size_t>> before_;
  mutable std::mutex mutex_;
  std::map<std::size_t, FitKey> known_;  ///< keys so far, which those of followers are made of
};

}  // namespace qjulia::batch
