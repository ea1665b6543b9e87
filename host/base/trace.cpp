#include "qjulia/base/trace.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <new>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/output_file.hpp"
#include "qjulia/base/version.hpp"

namespace qjulia {

using namespace base;
namespace {

/// A row's number in the file.
int number_of(Trace::Row row) { return 1 + static_cast<int>(row); }

std::string json_text(std::string_view text) {
  return nlohmann::json(text).dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
}

std::string row_name(Trace::Row row, std::string_view name) {
  return fmt::format(R"({{"ph":"M","name":"thread_name","pid":1,"tid":{},"args":{{"name":{}}}}})",
                     number_of(row), json_text(name));
}

double microseconds(std::int64_t nanoseconds) { return 1e-3 * static_cast<double>(nanoseconds); }

}  // namespace

void Trace::add(std::string_view name, Row row, Timer timer, Clock::time_point start,
                std::chrono::nanoseconds length) {
  const std::scoped_lock lock(adding_);
  auto kept = names_.find(name);
  if (kept == names_.end()) kept = names_.emplace(name).first;
  const auto since = std::chrono::duration_cast<std::chrono::nanoseconds>(start - begin_);
  events_.push_back({*kept, row, timer, since.count(), length.count()});
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
      << row_name(Row::host, "host") << ",\n"
      << row_name(Row::device, "device: " + device_name);
  for (const auto& [row, name] :
       {std::pair{Row::second_queue, "second"}, std::pair{Row::third_queue, "third"}}) {
    if (std::ranges::find(events_, row, &Event::row) == events_.end()) continue;
    out << ",\n" << row_name(row, fmt::format("{} queue: {}", name, device_name));
  }
  for (const Event& event : events_) {
    out << fmt::format(
        R"({}{{"ph":"X","name":{},"cat":"{}","pid":1,"tid":{},"ts":{:.3f},"dur":{:.3f},)"
        R"("args":{{"clock":"{}"}}}})",
        ",\n", json_text(event.name), event.row == Row::host ? "stage" : "kernel",
        number_of(event.row), microseconds(event.start), microseconds(event.length),
        event.timer == Timer::device ? "device" : "wall");
  }
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
