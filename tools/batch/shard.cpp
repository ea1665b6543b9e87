#include "batch/shard.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "base/fnv_hash.hpp"
#include "base/input_file.hpp"
#include "base/output_check.hpp"
#include "base/output_file.hpp"
#include "batch/folder_lock.hpp"
#include "batch/status.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia::batch {
namespace {

using nlohmann::json;

constexpr std::size_t kMostShards = 100'000;

/// A number of shards; more than there may be, for what is none.
std::size_t count_in(std::string_view text) {
  std::size_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool is_number = error == std::errc() && end == text.data() + text.size();
  return is_number ? std::min(value, kMostShards + 1) : kMostShards + 1;
}

/// One shard's folder, as far as merging reads it.
struct ShardFolder {
  std::filesystem::path path;
  Shard shard;
  std::size_t all_entries = 0;      ///< of the whole batch
  std::vector<std::size_t> places;  ///< of its entries there
  std::string manifest;
  std::string list_hash;  ///< Manifest::list_hash
  std::vector<EntryStatus> entries;
};

bool is_file_name(const std::string& name) {
  return name != "." && name != ".." && std::filesystem::path(name).filename() == name;
}

ShardFolder read_shard(const std::filesystem::path& path) {
  constexpr std::uint64_t kLargestIndex = std::uint64_t{64} << 20;
  ShardFolder folder;
  folder.path = path;
  folder.entries = read_batch(path, is_locked(path), UnreadableStatus::refused);
  std::vector<std::string> names;
  try {
    const json index =
        json::parse(base::read_text_file(path / "batch.json", "batch", kLargestIndex));
    const json& shard = index.at("shard");
    folder.shard = {shard.at("number"), shard.at("count")};
    folder.all_entries = shard.at("entries");
    folder.list_hash = shard.at("manifest_hash");
    folder.manifest = index.at("manifest");
    for (const json& entry : index.at("entries")) {
      folder.places.push_back(entry.at("place"));
      names.push_back(entry.at("name"));
    }
  } catch (const json::exception&) {
    throw InputError(fmt::format("'{}' is no shard of a batch: its batch.json does not say which",
                                 path.string()));
  }
  if (names.size() != folder.entries.size()) {
    throw InputError(fmt::format("'{}' changes while it is read; merge again", path.string()));
  }
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::string& name = folder.entries[i].name;
    if (name != names[i] || !is_file_name(name)) {
      throw InputError(fmt::format(
          "'{}' has '{}' in the status of '{}', which is not what the batch wrote; run the shard "
          "again",
          path.string(), name, names[i]));
    }
  }
  return folder;
}

/// The folders shard-I-of-N, which must be all of one division, by I.
std::vector<ShardFolder> shards_in(const std::filesystem::path& folder) {
  std::map<std::size_t, ShardFolder> found;
  std::error_code error;
  for (const auto& item : std::filesystem::directory_iterator(folder, error)) {
    const std::string name = item.path().filename().string();
    if (!name.starts_with("shard-") || !item.is_directory(error)) continue;
    ShardFolder shard = read_shard(item.path());
    const std::size_t number = shard.shard.number;
    const auto [at, is_new] = found.emplace(number, std::move(shard));
    if (!is_new) {
      throw InputError(fmt::format("'{}' and '{}' are the same shard; remove one of them",
                                   at->second.path.string(), item.path().string()));
    }
  }
  if (error) {
    throw InputError(fmt::format("'{}' cannot be read: {}; give the folder that shards wrote to",
                                 folder.string(), error.message()));
  }
  if (found.empty()) {
    throw InputError(fmt::format(
        "'{}' holds no shards; give the folder that 'batch run --shard' was given as --output",
        folder.string()));
  }
  const ShardFolder& first = found.begin()->second;
  for (const auto& [number, shard] : found) {
    if (shard.shard.count != first.shard.count || shard.list_hash != first.list_hash) {
      throw InputError(fmt::format(
          "'{}' is a shard of another batch or division than '{}'; remove the older of them",
          shard.path.string(), first.path.string()));
    }
  }
  std::vector<ShardFolder> shards;
  for (std::size_t number = 1; number <= first.shard.count; ++number) {
    const auto at = found.find(number);
    if (at == found.end()) {
      throw InputError(fmt::format("'{}' lacks shard {} of {}; run it, then merge again",
                                   folder.string(), number, first.shard.count));
    }
    shards.push_back(std::move(at->second));
  }
  return shards;
}

void copy_whole(const std::filesystem::path& from, const std::filesystem::path& to) {
  std::ifstream in(from, std::ios::binary);
  base::OutputFile out(to);
  if (!in || !(out.stream() << in.rdbuf())) {
    throw InputError(
        fmt::format("'{}' cannot be copied; --resume its shard, then merge again", from.string()));
  }
  out.commit();
}

/// Of the undivided list. Paths count by their last part: shards may run on machines on which the
/// same files lie in different places.
std::string hash_of_list(const Manifest& manifest) {
  base::FnvHash hash;
  const auto add = [&](const std::string& text) {
    hash.add(text.size());
    hash.add(text);
  };
  for (const BatchEntry& entry : manifest.entries) {
    add(entry.name);
    add(entry.mesh.filename().string());
    if (!entry.follows.empty()) add(entry.follows);
    for (const ManifestOption& option : entry.options) {
      add(option.name);
      for (const std::string& value : option.values) {
        add(std::filesystem::path(value).filename().string());
      }
    }
  }
  return hash.text();
}

/// Files of an entry, which must lie in its shard's folder.
std::vector<std::string> own_files(const EntryStatus& entry) {
  std::vector<std::string> files;
  if (entry.state != EntryState::done) return files;
  for (const std::string& name : entry.files) {
    if (is_file_name(name)) files.push_back(name);
  }
  return files;
}

}  // namespace

Shard shard_of(const std::string& text) {
  const std::string_view numbers = text;
  const std::size_t slash = std::min(numbers.find('/'), numbers.size());
  const std::size_t number = count_in(numbers.substr(0, slash));
  const std::size_t count = count_in(numbers.substr(std::min(slash + 1, numbers.size())));
  if (number < 1 || number > count || count > kMostShards) {
    throw InputError(
        fmt::format("'{}' is no shard; give I/N with I from 1 to N, such as 2/3, N at most {}",
                    text, kMostShards));
  }
  return {number, count};
}

std::optional<ScheduledShard> scheduled_shard(
    const std::function<const char*(const char*)>& variable) {
  const auto number = [&](const char* name) {
    const char* const text = variable(name);
    return count_in(text == nullptr ? "" : text);
  };
  if (variable("SLURM_ARRAY_TASK_ID") != nullptr) {
    const std::size_t task = number("SLURM_ARRAY_TASK_ID"), first = number("SLURM_ARRAY_TASK_MIN"),
                      last = number("SLURM_ARRAY_TASK_MAX"),
                      count = number("SLURM_ARRAY_TASK_COUNT");
    // Other arrays may be tasks of a larger one that are done again.
    const bool is_whole = count > 1 && last <= kMostShards && first <= 1 && first <= task &&
                          task <= last && last - first + 1 == count;
    if (!is_whole) {
      throw InputError(
          "SLURM_ARRAY_TASK_ID is set, and its array is not 1-N or 0-(N-1) with N of 2 or more, so "
          "the shard is not known; give --shard I/N, or --shard 1/1 for the whole batch");
    }
    return ScheduledShard{{task - first + 1, count}, "SLURM_ARRAY_TASK_ID"};
  }
  for (const char* const name : {"PBS_ARRAY_INDEX", "PBS_ARRAYID"}) {
    if (variable(name) == nullptr) continue;
    throw InputError(
        fmt::format("{0} is set, and PBS does not say of how many jobs; give --shard ${0}/N for an "
                    "array from 1 to N, or --shard 1/1 for the whole batch",
                    name));
  }
  return std::nullopt;
}

void check_division(const std::filesystem::path& folder, const Shard& shard) {
  std::error_code ignored;
  for (const auto& item : std::filesystem::directory_iterator(folder, ignored)) {
    const std::string name = item.path().filename().string();
    std::size_t number = 0, count = 0;
    int end = 0;
    const int read = std::sscanf(name.c_str(), "shard-%zu-of-%zu%n", &number, &count, &end);
    if (read != 2 || static_cast<std::size_t>(end) != name.size() || count == shard.count) continue;
    throw InputError(fmt::format(
        "'{}' is a shard of another division than {}/{}; give --shard I/{} to do one of its "
        "shards, or another --output",
        item.path().string(), shard.number, shard.count, count));
  }
}

void keep_shard(Manifest& manifest, const Shard& shard) {
  manifest.shard = shard;
  manifest.list_hash = hash_of_list(manifest);
  manifest.all_entries = manifest.entries.size();
  std::vector<BatchEntry> kept;
  std::map<std::string, std::size_t> parts;  // by entry; a sequence is one part
  std::size_t next_part = 0;
  for (std::size_t i = 0; i < manifest.entries.size(); ++i) {
    BatchEntry& entry = manifest.entries[i];
    const std::size_t part = entry.follows.empty() ? next_part++ : parts.at(entry.follows);
    parts.emplace(entry.name, part);
    if (part % shard.count != shard.number - 1) continue;
    entry.place = i;
    kept.push_back(std::move(entry));
  }
  manifest.entries = std::move(kept);
}

std::filesystem::path shard_folder(const std::filesystem::path& folder, const Shard& shard) {
  return folder / fmt::format("shard-{}-of-{}", shard.number, shard.count);
}

std::filesystem::path shard_file(const std::filesystem::path& file, const Shard& shard) {
  return file.parent_path() / fmt::format("{}-{}-of-{}{}", file.stem().string(), shard.number,
                                          shard.count, file.extension().string());
}

std::vector<EntryStatus> merge_shards(const std::filesystem::path& folder) {
  std::vector<ShardFolder> shards = shards_in(folder);
  const FolderLock lock(folder);
  const std::size_t all = shards.front().all_entries;
  std::vector<std::filesystem::path> inputs;
  std::vector<base::Output> outputs;
  std::set<std::string> names;
  std::map<std::size_t, std::pair<const ShardFolder*, const EntryStatus*>> by_place;
  for (const ShardFolder& shard : shards) {
    for (std::size_t i = 0; i < shard.entries.size(); ++i) {
      const EntryStatus& entry = shard.entries[i];
      if (shard.places[i] >= all || !by_place.insert({shard.places[i], {&shard, &entry}}).second) {
        throw InputError(fmt::format(
            "'{}' has an entry in a place of another; run the shards again", shard.path.string()));
      }
      names.insert(entry.name);
      inputs.emplace_back(entry.mesh);
      for (const std::string& name : own_files(entry)) outputs.push_back({"merged", folder / name});
    }
  }
  if (by_place.size() != all || names.size() != all) {
    throw InputError(
        fmt::format("the shards in '{}' hold {} of {} entries, with {} names; run the shards again",
                    folder.string(), by_place.size(), all, names.size()));
  }
  base::check_distinct(inputs, outputs);
  json index = json::array();
  std::vector<EntryStatus> entries;
  for (const auto& [place, from] : by_place) {
    const auto& [shard, entry] = from;
    for (const std::string& name : own_files(*entry)) copy_whole(shard->path / name, folder / name);
    write_status(folder, *entry);
    index.push_back({{"name", entry->name}, {"mesh", entry->mesh}, {"settings", entry->settings}});
    entries.push_back(*entry);
  }
  write_json(folder / "batch.json",
             {{"manifest", shards.front().manifest}, {"entries", std::move(index)}});
  return entries;
}

}  // namespace qjulia::batch
