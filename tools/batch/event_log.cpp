#include "batch/event_log.hpp"

#include <fcntl.h>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <functional>

#include "base/output_file.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia::batch {
namespace {

using Json = nlohmann::json;
using EventKind = BatchEvent::Kind;

const char* name_of_event(EventKind kind) {
  switch (kind) {
    case EventKind::started:
      return "started";
    case EventKind::progress:
      return "progress";
    case EventKind::done:
      return "done";
    case EventKind::failed:
      return "failed";
    case EventKind::given_back:
      return "given_back";
    case EventKind::interrupted:
      return "interrupted";
    case EventKind::retired:
      return "retired";
    case EventKind::rank_lost:
      return "rank_lost";
  }
  return "";
}

Json finite_or_null(double value) { return std::isfinite(value) ? Json(value) : Json(); }

/// UTC with milliseconds.
std::string moment() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  const auto milliseconds = std::chrono::duration_cast<std::chrono::milliseconds>(now).count();
  return fmt::format("{:%Y-%m-%dT%H:%M:%S}.{:03}Z",
                     fmt::gmtime(static_cast<std::time_t>(milliseconds / 1000)),
                     milliseconds % 1000);
}

/// A label's value, as Prometheus quotes it.
std::string quoted_label(const std::string& text) {
  std::string quoted;
  for (const char c : text) {
    if (c == '\n') {
      quoted += "\\n";
      continue;
    }
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += c;
  }
  return '"' + quoted + '"';
}

}  // namespace

EventLog::EventLog(const std::filesystem::path& file, bool keep, int rank)
    : file_(::open(file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC | (keep ? 0 : O_TRUNC),
                   0666)),
      rank_(rank) {
  if (file_ < 0) {
    throw OutputError(fmt::format("cannot write '{}': {}", file.string(), std::strerror(errno)));
  }
}

EventLog::~EventLog() { ::close(file_); }

void EventLog::write(const std::string& event, Json members) {
  members["event"] = event;
  members["time"] = moment();
  members["rank"] = rank_;
  // One call, so that lines of several processes do not mix.
  const std::string line = members.dump(-1, ' ', false, Json::error_handler_t::replace) + '\n';
  if (::write(file_, line.data(), line.size()) != static_cast<ssize_t>(line.size())) {
    has_failed_ = true;
  }
}

void EventLog::write(const BatchEvent& event) {
  if (event.elsewhere || event.earlier) return;
  Json members = Json::object();
  if (!event.device.empty()) {
    members[event.kind == EventKind::rank_lost ? "lost" : "device"] = event.device;
  }
  if (!event.message.empty()) members["message"] = event.message;
  if (const EntryStatus* const status = event.status) {
    if (event.kind == EventKind::progress) {
      const auto now = std::chrono::steady_clock::now();
      const auto [at, is_first] = last_.try_emplace(status->name, now);
      if (!is_first && now - at->second < std::chrono::seconds(1)) return;
      at->second = now;
      members["activity"] = status->progress.activity;
      members["fraction"] = finite_or_null(status->progress.fraction);
    } else {
      last_.erase(status->name);
    }
    members["entry"] = status->name;
    members["seconds"] = finite_or_null(status->seconds);
    if (status->energy) members["energy"] = finite_or_null(*status->energy);
    if (status->memory_bytes > 0) members["memory_bytes"] = status->memory_bytes;
    if (status->joules) members["joules"] = *status->joules;
    if (event.kind == EventKind::done) members["figures"] = status->figures;
  }
  write(name_of_event(event.kind), std::move(members));
}

std::string metrics_text(const std::map<std::string, KnownEntry>& entries, std::size_t all,
                         double time, const std::optional<Shard>& shard) {
  std::string text;
  const std::string shard_label =
      shard ? fmt::format("shard=\"{}/{}\"", shard->number, shard->count) : std::string();
  const std::string last_label = shard ? "," + shard_label : std::string();
  const auto describe = [&](const char* name, const char* help) {
    text += fmt::format("# HELP qjulia_batch_{0} {1}\n# TYPE qjulia_batch_{0} gauge\n", name, help);
  };
  std::map<EntryState, std::size_t> counts;
  for (const EntryState state : kEntryStates) counts[state] = 0;
  for (const auto& [name, entry] : entries) ++counts[entry.status.state];
  counts[EntryState::waiting] += all - std::min(all, entries.size());
  describe("entries", "Entries of the batch by state.");
  for (const auto& [state, count] : counts) {
    text += fmt::format("qjulia_batch_entries{{state=\"{}\"{}}} {}\n", to_string(state), last_label,
                        count);
  }
  const auto each = [&](const char* name, const char* help,
                        const std::function<std::optional<double>(const EntryStatus&)>& value) {
    describe(name, help);
    for (const auto& [name_of_entry, entry] : entries) {
      if (entry.elsewhere) continue;
      const auto number = value(entry.status);
      if (!number || !std::isfinite(*number)) continue;
      text += fmt::format("qjulia_batch_{}{{entry={},state=\"{}\"{}}} {}\n", name,
                          quoted_label(name_of_entry), to_string(entry.status.state), last_label,
                          *number);
    }
  };
  each("entry_seconds", "Wall time of the entry's latest run.",
       [](const EntryStatus& status) { return status.seconds; });
  each("entry_progress", "Done part of the entry, 0 to 1.", [](const EntryStatus& status) {
    return status.state == EntryState::done ? 1 : status.progress.fraction;
  });
  each("entry_energy", "Energy of the latest evaluation.",
       [](const EntryStatus& status) { return status.energy; });
  each("entry_memory_bytes", "Most memory that the process had at once in the run.",
       [](const EntryStatus& status) -> std::optional<double> {
         if (status.memory_bytes == 0) return std::nullopt;
         return static_cast<double>(status.memory_bytes);
       });
  each("entry_joules", "Energy that the device took in the entry's latest run.",
       [](const EntryStatus& status) { return status.joules; });
  describe("time_seconds", "Unix time at which this was written.");
  const std::string labels = shard ? "{" + shard_label + "}" : std::string();
  return text + fmt::format("qjulia_batch_time_seconds{} {:.3f}\n", labels, time);
}

MetricsFile::MetricsFile(std::filesystem::path file, std::size_t entries,
                         std::optional<Shard> shard)
    : file_(std::move(file)), entries_(entries), shard_(shard) {}

void MetricsFile::note(const BatchEvent& event) {
  if (event.status == nullptr) return;
  known_[event.status->name] = {*event.status, event.elsewhere};
  constexpr std::chrono::seconds kBetween{2};
  if (std::chrono::steady_clock::now() - written_ > kBetween) write();
}

void MetricsFile::write() {
  written_ = std::chrono::steady_clock::now();
  const std::chrono::duration<double> time = std::chrono::system_clock::now().time_since_epoch();
  base::write_file(file_, metrics_text(known_, entries_, time.count(), shard_));
}

}  // namespace qjulia::batch
