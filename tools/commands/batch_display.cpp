#include "commands/batch_display.hpp"

#include <fmt/format.h>
#include <unistd.h>

namespace qjulia::tools {
namespace {

using Kind = batch::BatchEvent::Kind;

constexpr std::chrono::milliseconds kBetweenTables{200};

std::string figures(const batch::EntryStatus& status) {
  std::string text = fmt::format("{:.1f} s", status.seconds);
  const auto add = [&](const char* name, const char* format) {
    if (status.figures.contains(name) && status.figures[name].is_number()) {
      text += fmt::format(fmt::runtime(format), status.figures[name].get<double>());
    }
  };
  add("energy", ", energy {:.3e}");
  add("iou", ", IoU {:.4f}");
  const auto warnings = status.figures.find("warnings");
  if (warnings != status.figures.end() && !warnings->empty()) {
    text += fmt::format(", {} warning{} (summary.json)", warnings->size(),
                        warnings->size() == 1 ? "" : "s");
  }
  return text + ", " + status.device;
}

}  // namespace

std::string describe(const batch::EntryStatus& status) {
  std::string text = fmt::format("{:11} {}", to_string(status.state), status.name);
  switch (status.state) {
    case batch::EntryState::done:
      return text + "  " + figures(status);
    case batch::EntryState::failed:
      return text + "  " + status.error;
    case batch::EntryState::running:
      return fmt::format("{}  {:.1f} s, {} {}; {} process {}", text, status.seconds,
                         status.progress.activity, describe(status.progress), status.host,
                         status.process);
    case batch::EntryState::lost:
      return fmt::format("{}  process {} on {} has ended without a word; --resume does it again",
                         text, status.process, status.host);
    case batch::EntryState::waiting:
      return status.error.empty() ? text : text + "  to be tried again: " + status.error;
    case batch::EntryState::interrupted:
      break;
  }
  return text;
}

BatchDisplay::BatchDisplay(Console& console, std::size_t entries)
    : console_(console),
      entries_(entries),
      table_(!console.quiet() && ::isatty(STDERR_FILENO) == 1) {}

BatchDisplay::~BatchDisplay() { clear_table(); }

void BatchDisplay::count(const batch::BatchEvent& event) {
  if (event.status == nullptr) return;
  const std::string& name = event.status->name;
  if (event.kind == Kind::started || event.kind == Kind::progress) {
    running_[name] = event.status->progress;
    return;
  }
  running_.erase(name);
  done_ += event.kind == Kind::done ? 1 : 0;
  failed_ += event.kind == Kind::failed ? 1 : 0;
  earlier_ += event.earlier ? 1 : 0;
}

void BatchDisplay::show(const batch::BatchEvent& event) {
  count(event);
  const bool said = !event.elsewhere && event.kind != Kind::started && event.kind != Kind::progress;
  if (said) clear_table();
  const std::string place = fmt::format("[{}/{}] ", done_ + failed_, entries_);
  switch (event.kind) {
    case Kind::started:
      if (!table_)
        console_.detail(fmt::format("begun       {}  {}", event.status->name, event.device));
      break;
    case Kind::progress:
      break;
    case Kind::done:
    case Kind::failed:
      if (event.elsewhere) break;
      if (event.earlier) {
        console_.detail(place + describe(*event.status) + " (before)");
      } else if (event.kind == Kind::done) {
        console_.note(place + describe(*event.status));
      } else {
        console_.warn(place + describe(*event.status));
      }
      break;
    case Kind::given_back:
      console_.warn(fmt::format("{} will be tried again: {}", event.status->name, event.message));
      break;
    case Kind::interrupted:
      console_.note(describe(*event.status));
      break;
    case Kind::retired:
      console_.warn(fmt::format("device {} is out of use: {}", event.device, event.message));
      break;
    case Kind::rank_lost:
      if (event.elsewhere) break;
      console_.warn(
          fmt::format("{} no longer answers and is given up: {}", event.device, event.message));
      break;
  }
  if (table_ && (said || Clock::now() - last_drawn_ > kBetweenTables)) draw_table();
}

std::string BatchDisplay::header() const {
  std::string text = fmt::format("{} of {} done, {} failed, {} running", done_, entries_, failed_,
                                 running_.size());
  const std::size_t finished = done_ + failed_ - earlier_;
  if (finished == 0) return text;
  const double seconds = std::chrono::duration<double>(Clock::now() - start_).count();
  const auto left = static_cast<double>(entries_ - done_ - failed_);
  return text + ", " + clock_time(seconds / static_cast<double>(finished) * left) + " left";
}

void BatchDisplay::draw_table() {
  clear_table();
  // One column stays free: a full line would wrap on some terminals.
  const std::size_t columns = terminal_columns() - 1;
  std::string text = header() + "\n";
  for (const auto& [name, progress] : running_) {
    Progress named = progress;
    named.activity = "  " + name;
    text += bar_line(named, columns) + "\n";
  }
  print_error(text);
  rows_drawn_ = 1 + running_.size();
  last_drawn_ = Clock::now();
}

void BatchDisplay::clear_table() {
  if (rows_drawn_ == 0) return;
  print_error(fmt::format("\x1b[{}A\r\x1b[J", rows_drawn_));
  rows_drawn_ = 0;
}

nlohmann::json report_json(const std::vector<batch::EntryStatus>& entries) {
  nlohmann::json all = nlohmann::json::array();
  for (const batch::EntryStatus& entry : entries) all.push_back(entry.to_json());
  return {{"entries", all}};
}

std::size_t count(const std::vector<batch::EntryStatus>& entries, batch::EntryState state) {
  return static_cast<std::size_t>(std::ranges::count(entries, state, &batch::EntryStatus::state));
}

std::string totals(const std::vector<batch::EntryStatus>& entries) {
  std::string text =
      fmt::format("{} of {} done", count(entries, batch::EntryState::done), entries.size());
  for (const batch::EntryState state : batch::kEntryStates) {
    const std::size_t n = count(entries, state);
    if (n > 0 && state != batch::EntryState::done) {
      text += fmt::format(", {} {}", n, batch::to_string(state));
    }
  }
  return text;
}

int batch_exit_code(const std::vector<batch::EntryStatus>& entries) {
  return count(entries, batch::EntryState::done) == entries.size() ? kDone : kFailed;
}

}  // namespace qjulia::tools
