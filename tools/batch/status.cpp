#include "batch/status.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <ctime>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/input_file.hpp"
#include "base/output_file.hpp"
#include "qjulia/error.hpp"

namespace qjulia::batch {
namespace {

using nlohmann::json;

constexpr std::uint64_t kLargestFile = std::uint64_t{64} << 20;

constexpr std::array<std::pair<EntryState, const char*>, 6> kStates{
    {{EntryState::waiting, "waiting"},
     {EntryState::running, "running"},
     {EntryState::lost, "lost"},
     {EntryState::interrupted, "interrupted"},
     {EntryState::failed, "failed"},
     {EntryState::done, "done"}}};

EntryState state_from(const std::string& text) {
  for (const auto& [state, name] : kStates) {
    if (text == name) return state;
  }
  return EntryState::waiting;
}

/// What is wrong with any of the file's values reads as if it were not there.
EntryStatus status_from(const json& j) {
  EntryStatus s;
  s.name = j.at("name");
  s.mesh = j.at("mesh");
  s.state = state_from(j.at("state"));
  s.key = {j.at("key").at("inputs"), j.at("key").at("options")};
  s.host = j.at("host");
  s.process = j.at("process");
  s.device = j.at("device");
  s.started = j.at("started");
  s.seconds = j.at("seconds");
  s.progress.activity = j.at("progress").at("activity");
  s.progress.fraction = j.at("progress").at("fraction");
  s.progress.seconds_left = j.at("progress").at("seconds_left");
  s.progress.detail = j.at("progress").at("detail");
  s.error = j.at("error");
  for (const json& f : j.at("failed_tries"))
    s.failed_tries.push_back({f.at("device"), f.at("error")});
  s.files = j.at("files").get<std::vector<std::string>>();
  s.figures = j.at("figures");
  return s;
}

/// File names need not be UTF-8.
std::string dump(const json& object) {
  return object.dump(1, ' ', false, json::error_handler_t::replace) + '\n';
}

}  // namespace

std::string to_string(EntryState state) {
  for (const auto& [each, name] : kStates) {
    if (each == state) return name;
  }
  return "waiting";
}

json EntryStatus::to_json() const {
  json tries = json::array();
  for (const auto& [tried, why] : failed_tries)
    tries.push_back({{"device", tried}, {"error", why}});
  return {{"name", name},
          {"mesh", mesh},
          {"state", to_string(state)},
          {"key", {{"inputs", key.inputs}, {"options", key.options}}},
          {"host", host},
          {"process", process},
          {"device", device},
          {"started", started},
          {"seconds", seconds},
          {"progress",
           {{"activity", progress.activity},
            {"fraction", progress.fraction},
            {"seconds_left", std::isfinite(progress.seconds_left) ? progress.seconds_left : -1},
            {"detail", progress.detail}}},
          {"error", error},
          {"failed_tries", tries},
          {"files", files},
          {"figures", figures}};
}

std::filesystem::path status_path(const std::filesystem::path& folder, const std::string& name) {
  return folder / (name + ".status.json");
}

std::optional<EntryStatus> read_status(const std::filesystem::path& folder,
                                       const std::string& name) {
  const auto path = status_path(folder, name);
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored)) return std::nullopt;
  const std::string text = base::read_text_file(path, "status", kLargestFile);
  try {
    return status_from(json::parse(text));
  } catch (const json::exception&) {
    return std::nullopt;
  }
}

void write_status(const std::filesystem::path& folder, const EntryStatus& status) {
  base::write_file(status_path(folder, status.name), dump(status.to_json()));
}

void write_index(const std::filesystem::path& folder, const Manifest& manifest) {
  json entries = json::array();
  for (const BatchEntry& entry : manifest.entries) {
    entries.push_back({{"name", entry.name}, {"mesh", entry.mesh.string()}});
  }
  base::write_file(folder / "batch.json",
                   dump({{"manifest", manifest.file.string()}, {"entries", entries}}));
}

std::string time_stamp() {
  return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)));
}

std::vector<EntryStatus> read_batch(const std::filesystem::path& folder, bool is_running) {
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
      if (auto known = read_status(folder, status.name)) status = std::move(*known);
      if (status.state == EntryState::running && !is_running) status.state = EntryState::lost;
      all.push_back(std::move(status));
    }
  } catch (const json::exception&) {
    throw InputError(
        fmt::format("'{}' holds no batch: its batch.json is missing or broken", folder.string()));
  }
  return all;
}

}  // namespace qjulia::batch
