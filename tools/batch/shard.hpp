#pragma once
/// Parts of a batch that run on their own, and the batch that they make together.

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "batch/batch.hpp"

namespace qjulia::batch {

/// "2/3": the second of three shards. @throws InputError
Shard shard_of(const std::string& text);

/// The shard that this job of an array is, by the scheduler's environment variables.
struct ScheduledShard {
  Shard shard;
  std::string variable;  ///< that says so
};
/// Of Slurm's arrays. None outside of an array.
/// @param variable its value, or null.
/// @throws InputError in arrays of PBS, whose variables do not say how many jobs there are, and in
/// arrays of Slurm that are not 1-N or 0-(N-1): they may be a part of one that is done again
std::optional<ScheduledShard> scheduled_shard(
    const std::function<const char*(const char*)>& variable);

/// @throws InputError where the folder holds shards of a division into another number.
void check_division(const std::filesystem::path& folder, const Shard& shard);

/// Leaves the entries of one shard: I, I + N, I + 2N … of the manifest.
void keep_shard(Manifest& manifest, const Shard& shard);

/// FOLDER/shard-I-of-N.
std::filesystem::path shard_folder(const std::filesystem::path& folder, const Shard& shard);

/// FILE-I-of-N.EXTENSION: what one shard writes where all are given FILE.EXTENSION.
std::filesystem::path shard_file(const std::filesystem::path& file, const Shard& shard);

/// Copies what the shards in a folder have made into the folder itself, and writes its batch.json.
/// Shards may be running, and it may be done again.
/// @return every entry, in the manifest's order.
/// @throws InputError where shards are missing, there twice, not of one manifest and division, or
/// not as they were written; OutputError
std::vector<EntryStatus> merge_shards(const std::filesystem::path& folder);

}  // namespace qjulia::batch
