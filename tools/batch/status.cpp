#include "batch/status.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <cmath>
#include <ctime>
#include <nlohmann/json.hpp>

#include "base/input_file.hpp"
#include "base/output_file.hpp"
#include "base/text.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Progress, activity, fraction, seconds_left, detail)

namespace batch {

NLOHMANN_JSON_SERIALIZE_ENUM(EntryState, {{EntryState::waiting, "waiting"},
                                          {EntryState::running, "running"},
                                          {EntryState::lost, "lost"},
                                          {EntryState::interrupted, "interrupted"},
                                          {EntryState::failed, "failed"},
                                          {EntryState::done, "done"}})
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(FitKey, inputs, options)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(FailedTry, device, error)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(EntryStatus, name, mesh, state, key, host, process, device,
                                   started, seconds, progress, error, failed_tries, files, figures)

namespace {

using nlohmann::json;

constexpr std::uint64_t kLargestFile = std::uint64_t{64} << 20;

/// Blanks in the status of an entry that is under way. Where the disk is full when the entry ends,
/// its last status takes their place, with the reason.
constexpr std::size_t kRoom = 2048;

}  // namespace

std::string to_string(EntryState state) { return json(state).get<std::string>(); }

json EntryStatus::to_json() const {
  json all = *this;
  all["earlier_seconds"] = earlier_seconds;
  all["settings"] = settings;
  all["energy"] = energy && std::isfinite(*energy) ? json(*energy) : json();
  all["joules"] = joules ? json(*joules) : json();
  all["memory_bytes"] = memory_bytes > 0 ? json(memory_bytes) : json();
  if (!std::isfinite(progress.seconds_left)) all["progress"]["seconds_left"] = -1.0;
  return all;
}

namespace {

/// File names need not be UTF-8.
std::string text_of(const json& object) {
  return object.dump(1, ' ', false, json::error_handler_t::replace) + '\n';
}

}  // namespace

void write_json(const std::filesystem::path& file, const json& object) {
  base::write_file(file, text_of(object));
}

std::filesystem::path status_path(const std::filesystem::path& folder, const std::string& name) {
  return folder / (name + ".status.json");
}

namespace {

/// Nothing where there is no status file, or where the file does not hold a status.
/// @throws InputError where it cannot be read
std::optional<EntryStatus> load_status(const std::filesystem::path& folder,
                                       const std::string& name) {
  const auto path = status_path(folder, name);
  std::error_code ignored;
  const auto type = std::filesystem::status(path, ignored).type();
  if (type == std::filesystem::file_type::not_found) return std::nullopt;
  try {
    const std::string text = base::read_text_file(path, "status", kLargestFile);
    if (base::is_json_too_deep(text)) return std::nullopt;
    const json all = json::parse(text);
    EntryStatus status = all.get<EntryStatus>();
    // Earlier versions did not write these.
    status.earlier_seconds = all.value("earlier_seconds", 0.0);
    if (all.contains("energy") && all["energy"].is_number()) status.energy = all["energy"];
    if (all.contains("memory_bytes") && all["memory_bytes"].is_number_unsigned()) {
      status.memory_bytes = all["memory_bytes"];
    }
    if (all.contains("joules") && all["joules"].is_number()) status.joules = all["joules"];
    if (all.contains("settings") && all["settings"].is_object()) status.settings = all["settings"];
    return status;
  } catch (const json::exception&) {
    return std::nullopt;
  }
}

}  // namespace

std::optional<EntryStatus> read_status(const std::filesystem::path& folder,
                                       const std::string& name) {
  try {
    return load_status(folder, name);
  } catch (const InputError&) {
    return std::nullopt;
  }
}

void write_status(const std::filesystem::path& folder, const EntryStatus& status) {
  const auto path = status_path(folder, status.name);
  const std::string text = text_of(status.to_json());
  const std::size_t room = status.state == EntryState::running ? kRoom : 0;
  try {
    base::write_file(path, text + std::string(room, ' '));
  } catch (const OutputError&) {
    if (!base::overwrite_file(path, text)) throw;
  }
}

json settings_of(const BatchEntry& entry, const BatchOptions& options) {
  json settings = options.settings ? options.settings(entry) : json::object();
  if (!entry.outputs.compare.empty()) {
    settings["compare"] = entry.outputs.compare;
    settings["compare_resolution"] = entry.outputs.compare_resolution;
  }
  return settings;
}

void write_index(const Manifest& manifest, const BatchOptions& options) {
  json entries = json::array();
  for (const BatchEntry& entry : manifest.entries) {
    json settings = json::object();
    try {
      settings = settings_of(entry, options);
    } catch (const InputError&) {
      // Such as a schedule that is gone: beginning the entry will say so, and fail it alone.
    }
    entries.push_back(
        {{"name", entry.name}, {"mesh", entry.mesh.string()}, {"settings", std::move(settings)}});
    if (manifest.shard) entries.back()["place"] = entry.place;
  }
  json index{{"manifest", manifest.file.string()}, {"entries", entries}};
  if (manifest.shard) {
    index["shard"] = {{"number", manifest.shard->number},
                      {"count", manifest.shard->count},
                      {"entries", manifest.all_entries},
                      {"manifest_hash", manifest.list_hash}};
  }
  write_json(options.folder / "batch.json", index);
}

std::string time_stamp() {
  return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)));
}

std::vector<EntryStatus> read_batch(const std::filesystem::path& folder, bool is_running,
                                    UnreadableStatus unreadable) {
  const auto path = folder / "batch.json";
  std::error_code ignored;
  json index;
  if (std::filesystem::is_regular_file(path, ignored)) {
    index = json::parse(base::read_text_file(path, "batch", kLargestFile), nullptr, false);
  }
  std::vector<EntryStatus> all;
  try {
    for (const json& entry : index.at("entries")) {
      EntryStatus status;
      status.name = entry.at("name");
      status.mesh = entry.at("mesh");
      try {
        if (auto known = load_status(folder, status.name)) status = std::move(*known);
      } catch (const InputError& error) {
        if (unreadable == UnreadableStatus::refused) throw;
        status.error = error.what();
      }
      if (status.settings.empty()) status.settings = entry.value("settings", json::object());
      if (status.state == EntryState::running && !is_running) status.state = EntryState::lost;
      all.push_back(std::move(status));
    }
  } catch (const json::exception&) {
    throw InputError(
        fmt::format("'{}' holds no batch: its batch.json is missing or broken", folder.string()));
  }
  return all;
}

}  // namespace batch
}  // namespace qjulia
