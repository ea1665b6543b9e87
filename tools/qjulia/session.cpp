#include "session.hpp"

#include <fmt/format.h>

#include "device_obstacles.hpp"
#include "files.hpp"
#include "qjulia/map_file.hpp"
#include "qjulia/tuning_cache.hpp"

namespace qjulia::tools {

Session::Session(const Verbosity& verbosity, std::string trace_file)
    : console(verbosity), trace_file_(std::move(trace_file)) {
  if (trace_file_.empty()) return;
  trace_ = std::make_shared<Trace>(start_);
}

void Session::check_outputs(const std::vector<std::filesystem::path>& inputs,
                            std::vector<base::Output> outputs) {
  if (trace_) outputs.push_back({"--trace", trace_file_});
  tools::check_outputs(inputs, outputs);
  for (const base::Output& output : outputs) {
    if (is_named_pipe(output.path)) {
      pipes_.push_back(opened_when_read(output.path, interrupts.token()));
    }
  }
  are_outputs_checked_ = true;
}

ProgressMonitor Session::monitor() {
  return {[this](const Progress& progress) { console.progress(progress); }, interrupts.token(),
          trace_};
}

void Session::finish() {
  if (!trace_ || !are_outputs_checked_) return;
  std::string name = "none";
  if (traced_) {
    traced_->record({});
    name = traced_->info().name;
  }
  trace_->add("qjulia", Trace::Row::host, Trace::Timer::wall, start_, Trace::Clock::now() - start_);
  trace_->write(trace_file_, name);
  console.note("trace: " + trace_file_);
}

RationalMap Session::read_map(const std::string& file) {
  const TraceStage stage(trace_, "read the map");
  return qjulia::read_map(file, interrupts.token());
}

TriangleMesh Session::read_mesh(const std::string& file) {
  const TraceStage stage(trace_, "read the mesh");
  MeshReport report;
  TriangleMesh mesh = qjulia::read_mesh(file, &report, interrupts.token());
  for (const std::string& warning : report.warnings()) {
    console.warn(fmt::format("{}: {}", file, warning));
  }
  return mesh;
}

Device Session::open_device(const std::string& wanted) {
  expect_descriptors();
  const auto [device, warning] = with_cached_tuning(Device::choose(wanted));
  if (!warning.empty()) console.warn(warning);
  const bool tuned = device.is_tuned(Precision::single) || device.is_tuned(Precision::dbl);
  console.note(fmt::format(
      "device: {}{}{}", describe(device.info()), tuned ? " (tuned)" : "",
      device.has_own_layout() ? "" : fmt::format(", {} layout", to_string(device.layout()))));
  if (trace_) {
    device.record(trace_);
    traced_ = device;
  }
  return device;
}

void Session::report_kernels(const Device& device) {
  if (!console.verbose()) return;
  for (const auto& [name, time] : device.kernel_times()) {
    console.detail(
        fmt::format("kernel {:24} {:7} launches {:9.3f} s", name, time.launches, time.seconds));
  }
}

std::string describe(const DeviceInfo& info) {
  return fmt::format("{}:{} {} {}", info.platform, info.index, to_string(info.kind), info.name);
}

}  // namespace qjulia::tools
