#include "batch/queue.hpp"

#include <algorithm>
#include <chrono>

#include "batch/status.hpp"
#include "qjulia/error.hpp"

namespace qjulia::batch {
namespace {

/// How often entries in other processes' hands are looked after.
constexpr std::chrono::milliseconds kBetweenLooks{250};

FitKey key_of(const BatchOptions& options, const BatchEntry& entry) {
  return options.key ? options.key(entry) : FitKey{};
}

bool files_exist(const std::filesystem::path& folder, const EntryStatus& status) {
  return std::ranges::all_of(status.files, [&](const std::string& name) {
    return std::filesystem::exists(folder / name);
  });
}

}  // namespace

Queue::Queue(const Manifest& manifest, const BatchOptions& options,
             std::function<void(const EntryStatus&)> settled_before)
    : manifest_(manifest),
      options_(options),
      settled_before_(std::move(settled_before)),
      places_(manifest.entries.size(), Place::open),
      claims_(manifest.entries.size()) {}

std::optional<Task> Queue::next(const std::set<std::size_t>& last_choice,
                                const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (!stop.stop_requested()) {
    if (const auto index = claim_any(last_choice)) {
      lock.unlock();  // a key takes reading the mesh
      Task task{*index, {}};
      const auto settled = settled_status(*index, task);
      if (!settled) return task;
      settled_before_(*settled);
      lock.lock();
      claims_[*index].reset();
      places_[*index] = Place::settled;
      changed_.notify_all();
      continue;
    }
    if (all_settled()) return std::nullopt;
    changed_.wait_for(lock, stop, kBetweenLooks, [this] {
      return std::ranges::find(places_, Place::open) != places_.end() || all_settled();
    });
    look_elsewhere();
  }
  return std::nullopt;
}

std::optional<std::size_t> Queue::claim_any(const std::set<std::size_t>& last_choice) {
  for (const bool last : {false, true}) {
    for (std::size_t i = 0; i < places_.size(); ++i) {
      if (places_[i] == Place::open && last_choice.contains(i) == last && claim(i)) return i;
    }
  }
  return std::nullopt;
}

bool Queue::claim(std::size_t index) {
  try {
    auto claim = Claim::take(claim_path(options_.folder, manifest_.entries[index].name));
    places_[index] = claim ? Place::here : Place::elsewhere;
    if (claim) claims_[index].emplace(std::move(*claim));
    return places_[index] == Place::here;
  } catch (const OutputError&) {
    // It is worked on unclaimed; the first thing to be written for it will say what is wrong.
    places_[index] = Place::here;
    return true;
  }
}

/// Entries given back by others, or claimed by processes that are no more, are open again.
void Queue::look_elsewhere() {
  for (std::size_t i = 0; i < places_.size(); ++i) {
    if (places_[i] != Place::elsewhere) continue;
    const auto path = claim_path(options_.folder, manifest_.entries[i].name);
    const ClaimState state = claim_state(path);
    if (state == ClaimState::none || (state == ClaimState::dead && break_dead_claim(path))) {
      places_[i] = Place::open;
    }
  }
}

/// The status of an entry that needs no work; otherwise fills in what the task starts with.
std::optional<EntryStatus> Queue::settled_status(std::size_t index, Task& task) const {
  const BatchEntry& entry = manifest_.entries[index];
  const FitKey key = key_of(options_, entry);
  auto known = read_status(options_.folder, entry.name);
  if (known && known->state == EntryState::done && files_exist(options_.folder, *known)) {
    // A mesh that is no more does not undo what was made of it.
    const bool same_inputs = known->key.inputs == key.inputs || key.inputs.empty();
    if (same_inputs && known->key.options == key.options) return known;
  }
  if (known && known->state == EntryState::failed && known->key == key) return known;
  task.status.name = entry.name;
  task.status.mesh = entry.mesh.string();
  task.status.key = key;
  if (known && known->key == key) task.status.failed_tries = known->failed_tries;
  return std::nullopt;
}

bool Queue::all_settled() const {
  return std::ranges::all_of(places_, [](Place p) { return p == Place::settled; });
}

void Queue::put_back(const EntryStatus& status, std::size_t index) {
  bool saved = true;
  try {
    write_status(options_.folder, status);
  } catch (const OutputError&) {
    saved = false;
  }
  const std::lock_guard lock(mutex_);
  std::erase_if(unsaved_, [&](const EntryStatus& s) { return s.name == status.name; });
  if (!saved) unsaved_.push_back(status);
  claims_[index].reset();
  const bool settled = status.state == EntryState::done || status.state == EntryState::failed;
  places_[index] = settled ? Place::settled : Place::open;
  changed_.notify_all();
}

void Queue::touch_claims() {
  const std::lock_guard lock(mutex_);
  for (const auto& claim : claims_) {
    if (claim) claim->touch();
  }
}

std::vector<EntryStatus> Queue::unsaved() const {
  const std::lock_guard lock(mutex_);
  return unsaved_;
}

}  // namespace qjulia::batch
