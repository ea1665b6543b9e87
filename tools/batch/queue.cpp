#include "batch/queue.hpp"

#include <time.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <thread>
#include <utility>

#include "batch/status.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia::batch {
namespace {

/// A rank with nothing to tell joins a round as often, so that others are not kept waiting.
constexpr std::chrono::milliseconds kBetweenRounds{50};

/// Of a clock that goes on while this process is stopped and while the machine sleeps.
std::chrono::nanoseconds since_boot() {
  timespec now{};
  ::clock_gettime(CLOCK_BOOTTIME, &now);
  return std::chrono::seconds(now.tv_sec) + std::chrono::nanoseconds(now.tv_nsec);
}

/// None is ever empty, except where a machine lost power.
bool files_exist(const std::filesystem::path& folder, const EntryStatus& status) {
  return std::ranges::all_of(status.files, [&](const std::string& name) {
    std::error_code error;
    return std::filesystem::file_size(folder / name, error) > 0 && !error;
  });
}

bool is_settled(EntryState state) {
  return state == EntryState::done || state == EntryState::failed;
}

}  // namespace

Queue::Queue(const Manifest& manifest, const BatchOptions& options, BatchRanks* ranks,
             std::size_t runners, std::function<void(const Settled&)> observe_settled,
             std::function<void(const LostRank&)> observe_lost)
    : manifest_(manifest),
      options_(options),
      ranks_(ranks),
      rank_(ranks == nullptr ? 0 : static_cast<std::size_t>(ranks->rank())),
      observe_settled_(std::move(observe_settled)),
      observe_lost_(std::move(observe_lost)),
      keys_(manifest, options),
      places_(manifest.entries.size(), Place::open),
      is_ready_(!options.resume),
      held_(runners),
      runners_(runners) {
  // So that giving an entry back needs no memory.
  put_back_.reserve(places_.size() + runners);
}

std::optional<std::size_t> Queue::next(std::size_t runner, const std::set<std::size_t>& last_choice,
                                       const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  requests_.insert_or_assign(runner, Request{last_choice, std::nullopt});
  tell();
  changed_.wait(lock, stop,
                [&] { return requests_[runner].answer || all_settled() || has_failed_; });
  const auto answer = requests_[runner].answer;
  requests_.erase(runner);
  if (!answer) return std::nullopt;
  if (stop.stop_requested()) {  // handed over in the same moment
    put_back_.push_back({*answer, EntryState::waiting});
    tell();
    return std::nullopt;
  }
  held_[runner] = answer;
  return answer;
}

void Queue::put_back(std::size_t runner, std::size_t index, const EntryStatus& status) {
  std::optional<EntryStatus> unsaved;
  try {
    write_status(options_.folder, status);
  } catch (const OutputError& error) {
    unsaved = status;
    if (unsaved->error.empty()) unsaved->error = error.what();
  }
  const std::lock_guard lock(mutex_);
  std::erase_if(unsaved_, [&](const EntryStatus& s) { return s.name == status.name; });
  if (unsaved) unsaved_.push_back(std::move(*unsaved));
  if (is_settled(status.state)) settled_here_[index] = {status, Settled::By::this_rank};
  put_back_.push_back({index, status.state});
  held_[runner] = std::nullopt;
  tell();
}

void Queue::tell() {
  has_news_ = true;
  news_.notify_all();
}

void Queue::leave(std::size_t runner) noexcept {
  const std::lock_guard lock(mutex_);
  if (held_[runner]) put_back_.push_back({*held_[runner], EntryState::waiting});
  held_[runner] = std::nullopt;
  --runners_;
  tell();
}

bool Queue::is_heard() const { return since_boot() - last_sent_ < ranks_->patience() / 2; }

void Queue::expect_own_entries() {
  // Nobody gives rank 0 up and does its entries.
  if (ranks_ == nullptr || rank_ == 0) return;
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return has_failed_ || is_heard(); });
  if (!has_failed_) return;
  throw Error("this rank has left the batch; it writes no more files");
}

void Queue::run() {
  try {
    // Beside the rounds: reading many large meshes takes longer than others wait for a rank.
    std::jthread looking;
    if (options_.resume) {
      looking = std::jthread([&](const std::stop_token& stop) { look_at_earlier(stop); });
    }
    bool is_runner_left = true;
    while (is_runner_left) {
      const RoundMessage mine = message();
      // Before this rank is heard: a stop after that must not look as if it were shorter.
      const auto sent = since_boot();
      const auto messages = exchange(mine);
      replay(messages, sent);
      is_runner_left =
          std::ranges::any_of(messages, [](const auto& m) { return m && m->runners > 0; });
    }
  } catch (...) {
    const std::lock_guard lock(mutex_);
    has_failed_ = true;
    changed_.notify_all();
    throw;
  }
}

/// A runner that has an answer and has not woken up yet asks for nothing, because a second answer
/// would replace the first.
RoundMessage Queue::message() {
  std::unique_lock lock(mutex_);
  news_.wait_for(lock, kBetweenRounds, [&] { return has_news_; });
  has_news_ = false;
  if (not_ready_) std::rethrow_exception(not_ready_);
  RoundMessage message{runners_, is_ready_, put_back_, {}};
  put_back_.clear();
  for (const auto& [runner, request] : requests_) {
    if (!request.answer) message.requests.push_back({runner, request.last_choice});
  }
  return message;
}

Queue::Messages Queue::exchange(const RoundMessage& mine) {
  if (ranks_ == nullptr) return {mine};
  Messages messages;
  for (const auto& bytes : ranks_->exchange(packed(mine))) {
    messages.push_back(bytes ? std::optional(unpacked(*bytes)) : std::nullopt);
  }
  return messages;
}

void Queue::replay(const Messages& messages, std::chrono::nanoseconds sent) {
  std::vector<Settled> settled;
  std::vector<LostRank> lost;
  std::unique_lock lock(mutex_);
  last_sent_ = sent;
  bool are_ready = true;
  for (std::size_t rank = 0; rank < messages.size(); ++rank) {
    if (messages[rank] && messages[rank]->is_ready) ready_.insert(rank);
    are_ready = are_ready && (!messages[rank] || ready_.contains(rank));
    if (messages[rank]) {
      std::ranges::move(place_back(rank, *messages[rank]), std::back_inserter(settled));
    } else if (auto given_up = give_up(rank)) {
      lost.push_back(std::move(*given_up));
    }
  }
  for (std::size_t rank = 0; rank < messages.size(); ++rank) {
    if (messages[rank] && are_ready) hand_out(rank, *messages[rank]);
  }
  changed_.notify_all();
  lock.unlock();
  for (const Settled& entry : settled) observe_settled_(entry);
  for (const LostRank& rank : lost) {
    if (observe_lost_) observe_lost_(rank);
  }
}

std::optional<LostRank> Queue::give_up(std::size_t rank) {
  if (!lost_.insert(rank).second) return std::nullopt;
  LostRank lost{rank, {}};
  for (const auto& [index, taker] : takers_) {
    if (taker != rank || places_[index] != Place::taken) continue;
    places_[index] = Place::open;
    lost.entries.push_back(manifest_.entries[index].name);
  }
  return lost;
}

std::vector<Settled> Queue::place_back(std::size_t rank, const RoundMessage& message) {
  std::vector<Settled> settled;
  for (const auto& [index, state] : message.put_back) {
    places_.at(index) = is_settled(state) ? Place::settled : Place::open;
    if (state == EntryState::failed) failed_.insert(index);
    if (!is_settled(state)) continue;
    if (rank == rank_) {
      settled.push_back(std::move(settled_here_.extract(index).mapped()));
    } else {
      EntryStatus status;
      status.name = manifest_.entries[index].name;
      status.state = state;
      settled.push_back({std::move(status), Settled::By::other_rank});
    }
  }
  return settled;
}

/// Those first that an entry is left for which they have not failed, so that one that they have
/// goes to another if it can.
void Queue::hand_out(std::size_t rank, const RoundMessage& message) {
  std::set<std::size_t> served;
  for (const bool last : {false, true}) {
    for (const auto& [runner, last_choice] : message.requests) {
      if (served.contains(runner)) continue;
      const auto index = choose(last_choice, last);
      if (!index) continue;
      served.insert(runner);
      places_[*index] = Place::taken;
      takers_[*index] = rank;
      if (rank != rank_) continue;
      const auto request = requests_.find(runner);
      if (request != requests_.end()) {
        request->second.answer = index;
      } else {  // a stop was asked of it meanwhile
        put_back_.push_back({*index, EntryState::waiting});
        tell();
      }
    }
  }
}

std::optional<std::size_t> Queue::choose(const std::set<std::size_t>& last_choice,
                                         bool last) const {
  for (std::size_t i = 0; i < places_.size(); ++i) {
    if (places_[i] != Place::open || last_choice.contains(i) != last) continue;
    const auto before = keys_.before(i);
    if (!before || places_[*before] == Place::settled) return i;
  }
  return std::nullopt;
}

void Queue::look_at_earlier(const std::stop_token& stop) {
  std::exception_ptr failure;
  try {
    settle_earlier(stop);
  } catch (...) {
    failure = std::current_exception();
  }
  const std::lock_guard lock(mutex_);
  not_ready_ = failure;
  is_ready_ = failure == nullptr;
  tell();
}

/// This rank looks at its share of the entries: one of every `size`.
void Queue::settle_earlier(const std::stop_token& stop) {
  const std::size_t size = ranks_ == nullptr ? 1 : static_cast<std::size_t>(ranks_->size());
  for (std::size_t i = rank_; i < places_.size() && !stop.stop_requested(); i += size) {
    const auto status = settled_status(i);
    if (!status) continue;
    const std::lock_guard lock(mutex_);
    put_back_.push_back({i, status->state});
    settled_here_[i] = {*status, Settled::By::earlier_run};
    tell();
  }
}

/// The status of an entry that needs no work.
std::optional<EntryStatus> Queue::settled_status(std::size_t index) {
  const BatchEntry& entry = manifest_.entries[index];
  auto known = read_status(options_.folder, entry.name);
  if (!known || !is_settled(known->state)) return std::nullopt;
  const FitKey key = keys_.of(index);
  if (known->state == EntryState::failed) {
    return known->key == key ? std::move(known) : std::nullopt;
  }
  // A missing mesh does not undo results made from it.
  const bool same_inputs = known->key.inputs == key.inputs || key.inputs.empty();
  const bool same = same_inputs && known->key.options == key.options;
  return same && files_exist(options_.folder, *known) ? std::move(known) : std::nullopt;
}

bool Queue::all_settled() const {
  return std::ranges::all_of(places_, [](Place p) { return p == Place::settled; });
}

bool Queue::has_start(std::size_t index) const {
  const std::lock_guard lock(mutex_);
  const auto before = keys_.before(index);
  return !before || (places_[*before] == Place::settled && !failed_.contains(*before));
}

std::vector<EntryStatus> Queue::unsaved() const {
  const std::lock_guard lock(mutex_);
  return unsaved_;
}

}  // namespace qjulia::batch
