#include "qjulia/base/trace.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <new>
#include <nlohmann/json.hpp>
#include <ostream>
#include <tuple>
#include <utility>

#include "base/output_file.hpp"
#include "qjulia/base/version.hpp"

namespace qjulia {

using namespace base;
namespace {

constexpr std::array kQueues{Trace::Row::device, Trace::Row::second_queue, Trace::Row::third_queue};

/// A row's number in the file, and that of the calls for a queue's kernels.
int number_of(Trace::Row row) { return 1 + static_cast<int>(row); }
int number_of_calls(Trace::Row queue) {
  return number_of(Trace::Row::third_queue) + static_cast<int>(queue);
}

/// The number of one of the host's rows. The first has its own; the others come after all rows of
/// queues.
int number_of_host(std::size_t row) {
  const int after_all = number_of_calls(Trace::Row::third_queue) + static_cast<int>(row);
  return row == 0 ? number_of(Trace::Row::host) : after_all;
}

/// What stands before a name where it is of one of several queues.
const char* ordinal(Trace::Row queue) {
  switch (queue) {
    case Trace::Row::second_queue:
      return "second queue: ";
    case Trace::Row::third_queue:
      return "third queue: ";
    case Trace::Row::host:
    case Trace::Row::device:
      break;
  }
  return "";
}

std::string json_text(std::string_view text) {
  return nlohmann::json(text).dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
}

/// A row's name, and its place among the others.
std::string row_name(int row, int place, std::string_view name) {
  return fmt::format(R"({{"ph":"M","name":"thread_name","pid":1,"tid":{0},"args":{{"name":{1}}}}},)"
                     "\n"
                     R"({{"ph":"M","name":"thread_sort_index","pid":1,"tid":{0},)"
                     R"("args":{{"sort_index":{2}}}}})",
                     row, json_text(name), place);
}

double microseconds(std::int64_t nanoseconds) { return 1e-3 * static_cast<double>(nanoseconds); }

std::string sides(const std::array<std::size_t, 3>& range) {
  return fmt::format("[{},{},{}]", range[0], range[1], range[2]);
}

}  // namespace

/// Lines of the file in the order of their times.
struct Trace::Lines {
  /// Of one time: what lasts stands before what happens in it.
  enum class Kind : std::uint8_t { lasting, call, flow_begin, flow_end, more, less, memory };
  struct Line {
    std::int64_t at;
    std::int64_t length;  ///< of what lasts: the longer comes first
    Kind kind;
    std::size_t index;  ///< in the trace's events, launches or memory
  };

  const Trace& trace;
  std::vector<Line> lines{};
  std::array<std::size_t, kQueues.size() + 1> depth{};  ///< launches in a queue, by its row
  /// By event: stages of several threads may overlap without nesting, which viewers do not show in
  /// one row. Those that do are on further rows of the host, from 1.
  std::vector<std::size_t> host_row{};
  std::size_t host_rows = 1;

  explicit Lines(const Trace& whole) : trace(whole) {
    for (std::size_t i = 0; i < trace.events_.size(); ++i) {
      const Event& event = trace.events_[i];
      lines.push_back({event.start, event.length, Kind::lasting, i});
    }
    for (std::size_t i = 0; i < trace.launches_.size(); ++i) {
      const Launch& launch = trace.launches_[i];
      const Event& kernel = trace.events_[launch.event];
      const std::int64_t asked = trace.since_begin(launch.call.before);
      lines.push_back({asked, call_length(launch), Kind::call, i});
      lines.push_back({asked, 0, Kind::flow_begin, i});
      lines.push_back({kernel.start, 0, Kind::flow_end, i});
      lines.push_back({asked, 0, Kind::more, i});
      lines.push_back({kernel.start + kernel.length, 0, Kind::less, i});
    }
    for (std::size_t i = 0; i < trace.memory_.size(); ++i) {
      lines.push_back({trace.memory_[i].at, 0, Kind::memory, i});
    }
    std::ranges::stable_sort(lines, [](const Line& a, const Line& b) {
      return std::tuple(a.at, a.kind, -a.length) < std::tuple(b.at, b.kind, -b.length);
    });
    divide_host();
  }

  /// Puts each stage on the first row on which it nests.
  void divide_host() {
    host_row.assign(trace.events_.size(), 0);
    std::vector<std::vector<std::int64_t>> ends(1);  // of the stages that are open, by row
    for (const Line& line : lines) {
      if (line.kind != Kind::lasting || trace.events_[line.index].row != Row::host) continue;
      const std::int64_t end = line.at + line.length;
      const auto takes = [&](std::vector<std::int64_t>& open) {
        while (!open.empty() && open.back() <= line.at) open.pop_back();
        return open.empty() || end <= open.back();
      };
      auto row = std::ranges::find_if(ends, takes);
      if (row == ends.end()) row = ends.emplace(row);
      row->push_back(end);
      host_row[line.index] = static_cast<std::size_t>(row - ends.begin());
    }
    host_rows = ends.size();
  }

  int row_of(std::size_t index) const {
    if (trace.events_[index].row != Row::host) return number_of(trace.events_[index].row);
    return number_of_host(host_row[index]);
  }

  static std::int64_t call_length(const Launch& launch) {
    return std::chrono::nanoseconds(launch.call.after - launch.call.before).count();
  }

  /// The launch of each event; null for what is no kernel with a call.
  std::vector<const Launch*> launch_of_event() const {
    std::vector<const Launch*> found(trace.events_.size(), nullptr);
    for (const Launch& launch : trace.launches_) found[launch.event] = &launch;
    return found;
  }

  std::string lasting(std::size_t index, const Launch* launch) const {
    const Event& event = trace.events_[index];
    std::string text =
        fmt::format(R"({{"ph":"X","name":{},"cat":"{}","pid":1,"tid":{},"ts":{:.3f},"dur":{:.3f},)"
                    R"("args":{{"clock":"{}")",
                    json_text(event.name), event.row == Row::host ? "stage" : "kernel",
                    row_of(index), microseconds(event.start), microseconds(event.length),
                    event.timer == Timer::device ? "device" : "wall");
    if (launch == nullptr) return text + "}}";
    const Call& call = launch->call;
    if (call.slots > 0) text += fmt::format(R"(,"slots":{})", nlohmann::json(call.slots).dump());
    if (call.slots > 0 && call.at_most) text += R"(,"slots_are_at_most":true)";
    if (call.bytes > 0) text += fmt::format(R"(,"bytes":{})", nlohmann::json(call.bytes).dump());
    return text + fmt::format(R"(,"global_size":{},"local_size":{},"queued_us":{:.3f}}}}})",
                              sides(call.global), sides(call.local),
                              microseconds(event.start - trace.since_begin(call.before)));
  }

  std::string call(const Launch& launch, std::int64_t at) const {
    const Event& kernel = trace.events_[launch.event];
    return fmt::format(
        R"({{"ph":"X","name":{},"cat":"call","pid":1,"tid":{},"ts":{:.3f},"dur":{:.3f}}})",
        json_text(kernel.name), number_of_calls(kernel.row), microseconds(at),
        microseconds(call_length(launch)));
  }

  std::string flow(char phase, std::size_t number, std::int64_t at) const {
    const Row row = trace.events_[trace.launches_[number].event].row;
    return fmt::format(
        R"({{"ph":"{}",{}"name":"launch","cat":"launch","id":{},"pid":1,"tid":{},"ts":{:.3f}}})",
        phase, phase == 'f' ? R"("bp":"e",)" : "", number + 1,
        phase == 'f' ? number_of(row) : number_of_calls(row), microseconds(at));
  }

  static std::string counter(Row queue, const char* name, const char* unit, std::int64_t at,
                             std::size_t value) {
    return fmt::format(R"({{"ph":"C","name":"{}{}","pid":1,"ts":{:.3f},"args":{{"{}":{}}}}})",
                       ordinal(queue), name, microseconds(at), unit, value);
  }

  std::string launches_after(const Launch& launch, bool is_more, std::int64_t at) {
    const Row row = trace.events_[launch.event].row;
    std::size_t& now = depth.at(static_cast<std::size_t>(row));
    // Some drivers say that a kernel ended before its call.
    now = is_more ? now + 1 : now - std::min<std::size_t>(now, 1);
    return counter(row, "launches in the queue", "launches", at, now);
  }

  void write(std::ostream& out) {
    const auto launches = launch_of_event();
    for (const auto& [at, length, kind, index] : lines) {
      out << ",\n";
      switch (kind) {
        case Kind::lasting:
          out << lasting(index, launches[index]);
          break;
        case Kind::call:
          out << call(trace.launches_[index], at);
          break;
        case Kind::flow_begin:
          out << flow('s', index, at);
          break;
        case Kind::flow_end:
          out << flow('f', index, at);
          break;
        case Kind::more:
        case Kind::less:
          out << launches_after(trace.launches_[index], kind == Kind::more, at);
          break;
        case Kind::memory:
          out << counter(trace.memory_[index].row, "memory of buffers", "bytes", at,
                         trace.memory_[index].bytes);
          break;
      }
    }
  }
};

std::int64_t Trace::since_begin(Clock::time_point at) const {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(at - begin_).count();
}

void Trace::add_locked(std::string_view name, Row row, Timer timer, Clock::time_point start,
                       std::chrono::nanoseconds length) {
  auto kept = names_.find(name);
  if (kept == names_.end()) kept = names_.emplace(name).first;
  events_.push_back({*kept, row, timer, since_begin(start), length.count()});
}

void Trace::add(std::string_view name, Row row, Timer timer, Clock::time_point start,
                std::chrono::nanoseconds length) {
  const std::scoped_lock lock(adding_);
  add_locked(name, row, timer, start, length);
}

void Trace::add_launch(std::string_view kernel, Row row, Timer timer, Clock::time_point start,
                       std::chrono::nanoseconds length, const Call& call) {
  const std::scoped_lock lock(adding_);
  add_locked(kernel, row, timer, start, length);
  launches_.push_back({events_.size() - 1, call});
}

void Trace::add_memory(Row row, Clock::time_point at, std::size_t bytes) {
  const std::scoped_lock lock(adding_);
  memory_.push_back({row, since_begin(at), bytes});
}

void Trace::write(const std::filesystem::path& path, const std::string& device_name,
                  const std::map<std::string, double>& figures) const {
  OutputFile file(path);
  auto& out = file.stream();
  out << fmt::format(R"({{"displayTimeUnit":"ms","otherData":{{"program":{},"device":{})",
                     json_text(std::string("qjulia ") + version()), json_text(device_name));
  for (const auto& [name, number] : figures) {
    out << fmt::format(",{}:{}", json_text(name), nlohmann::json(number).dump());
  }
  out << "},\"traceEvents\":[\n"
      << R"({"ph":"M","name":"process_name","pid":1,"args":{"name":"qjulia"}})"
      << ",\n"
      << row_name(number_of(Row::host), 0, "host");
  Lines lines(*this);
  int place = 1;
  for (std::size_t row = 1; row < lines.host_rows; ++row, ++place) {
    out << ",\n" << row_name(number_of_host(row), place, "host, at the same time");
  }
  for (const Row queue : kQueues) {
    if (std::ranges::find(events_, queue, &Event::row) == events_.end()) continue;
    out << ",\n"
        << row_name(number_of_calls(queue), place, fmt::format("{}launches", ordinal(queue)))
        << ",\n"
        << row_name(number_of(queue), place + 1,
                    fmt::format("{}device: {}", ordinal(queue), device_name));
    place += 2;
  }
  lines.write(out);
  out << "\n]}\n";
  file.commit();
}

TraceStage::TraceStage(const std::shared_ptr<Trace>& trace, std::string_view name)
    : trace_(trace.get()) {
  if (trace_ == nullptr) return;
  name_ = name;
  start_ = Trace::Clock::now();
}

TraceStage::~TraceStage() {
  if (trace_ == nullptr) return;
  try {
    trace_->add(name_, Trace::Row::host, Trace::Timer::wall, start_, Trace::Clock::now() - start_);
  } catch (const std::bad_alloc&) {
    // A stage less in the trace; the work goes on.
    return;
  }
}

}  // namespace qjulia
