#include "jobs/session.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>
#include <thread>

#include "base/output_file.hpp"
#include "console/device_obstacles.hpp"
#include "describe/files.hpp"
#include "describe/provenance.hpp"
#include "jobs/check_process.hpp"
#include "jobs/run_facts.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/check/self_test.hpp"
#include "qjulia/device/tuning_cache.hpp"
#include "qjulia/map/map_file.hpp"

namespace qjulia::tools {
namespace {

/// Whether it is a pipe that others can open by its name.
bool is_named_pipe(const std::filesystem::path& path) {
  std::error_code ignored;
  return std::filesystem::is_fifo(path, ignored) &&
         !base::link_target(path).string().starts_with("/proc/");
}

/// Waits until somebody reads the pipe. @return its descriptor. @throws OutputError, Interrupted
int opened_when_read(const std::filesystem::path& pipe, const std::stop_token& stop) {
  constexpr std::chrono::milliseconds kBetweenTries{50};
  int file = -1;
  while ((file = ::open(pipe.c_str(), O_WRONLY | O_NONBLOCK | O_CLOEXEC)) < 0) {
    if (errno != ENXIO && errno != EINTR) {
      throw OutputError(fmt::format("cannot write '{}': {}", pipe.string(), std::strerror(errno)));
    }
    throw_if_stopped(stop);
    std::this_thread::sleep_for(kBetweenTries);
  }
  return file;
}

/// The waiting time between `then` and `now`. `most_queued_seconds` is not a difference: it is the
/// maximum since the device was opened.
WaitTime since(const WaitTime& then, WaitTime now) {
  now.seconds -= then.seconds;
  now.processor_seconds -= then.processor_seconds;
  now.slept_seconds -= then.slept_seconds;
  now.waits -= then.waits;
  now.transfers -= then.transfers;
  return now;
}

}  // namespace

Session::Session(const Verbosity& verbosity, std::string trace_file, std::string profile_file)
    : interrupts_(std::make_unique<Interrupts>()),
      stop_(interrupts_->token()),
      console(verbosity),
      trace_file_(std::move(trace_file)),
      profile_file_(std::move(profile_file)) {
  if (!trace_file_.empty() || !profile_file_.empty()) trace_ = std::make_shared<Trace>(start_);
  if (!profile_file_.empty()) counter_ = std::make_unique<profiling::LaunchCounter>();
}

Session::Session(JobPlace place, Said& said)
    : place_(std::move(place)),
      stop_(place_.monitor.stop),
      console(said),
      trace_(place_.monitor.trace) {}

Session::~Session() {
  for (const int pipe : pipes_) ::close(pipe);
}

void Session::check_outputs(const Plan& plan) {
  std::vector<base::Output> outputs = plan.outputs;
  if (trace_ && !trace_file_.empty()) outputs.push_back({"--trace", trace_file_});
  if (trace_ && !profile_file_.empty()) outputs.push_back({"--profile", profile_file_, {".json"}});
  base::check_distinct(plan.inputs, outputs);
  for (const base::Output& output : outputs) base::check_writable(output);
  for (const base::Output& output : outputs) {
    if (is_named_pipe(output.path)) {
      pipes_.push_back(opened_when_read(output.path, stop()));
    }
  }
  for (const auto& [name, path] : plan.further_inputs) {
    Job::Input& input = job_.inputs[name];
    std::error_code ignored;
    if (!input.hash.empty() && std::filesystem::is_regular_file(path, ignored) &&
        file_hash(path) != input.hash) {
      console.warn(fmt::format("'{}' has changed since the job ran", path.string()));
    }
    input = {path, {}};
  }
  // Files may change while the command works.
  job_.hash_inputs();
  are_outputs_checked_ = true;
}

ProgressMonitor Session::monitor() {
  if (!interrupts_) return place_.monitor;
  return {[this](const Progress& progress) { console.progress(progress); }, stop(), trace_};
}

void Session::finish() {
  if (!trace_ || !are_outputs_checked_) return;
  const double command_seconds = seconds() - meter_seconds_;
  std::string name = "none";
  std::map<std::string, double> figures;
  if (traced_) {
    traced_->record({});
    name = traced_->info().name;
    const WaitTime waited = since(untraced_wait_, traced_->wait_time());
    const base::BuildTotal built = base::build_total();
    figures = {{"waited_seconds", waited.seconds},
               {"waiting_processor_seconds", waited.processor_seconds},
               {"waiting_slept_seconds", waited.slept_seconds},
               {"programs_compiled", built.compiled},
               {"programs_loaded", built.loaded},
               {"build_seconds", built.seconds},
               {"waits", static_cast<double>(waited.waits)},
               {"transfers", static_cast<double>(waited.transfers)},
               {"most_queued_seconds", waited.most_queued_seconds}};
  }
  trace_->add("qjulia", Trace::Row::host, Trace::Timer::wall, start_, Trace::Clock::now() - start_);
  if (!trace_file_.empty()) {
    trace_->write(trace_file_, name, figures);
    console.note("trace: " + trace_file_);
  }
  if (!profile_file_.empty()) write_profile(command_seconds);
}

void Session::write_profile(double seconds) {
  const auto work = counter_->work();
  const profiling::CommandMeasure measure =
      meter_ ? meter_->finish(start_) : profiling::CommandMeasure{};
  const profiling::CommandProfile profile = profiling::command_profile(
      traced_ ? traced_->info() : DeviceInfo{}, *trace_, work, measure, seconds);
  nlohmann::json json = to_json(profile);
  json["made"] = run_facts(job_, /*with_host=*/false);
  base::write_file(profile_file_, json.dump(2, ' ', true) + "\n");
  console.note(fmt::format("{}\nprofile: {}", to_text(profile), profile_file_));
  if (!measure.no_instructions.empty()) console.note(measure.no_instructions);
  if (const auto signs = profile.disturbances(); !signs.empty()) console.warn(busy_text(signs));
}

void Session::start_meter(const Device& device) {
  if (!counter_ || meter_) return;
  const double before = seconds();
  const profiling::LaunchCounter
      apart;  // so that the command's does not count the meter's launches
  meter_ = std::make_unique<profiling::CommandMeter>(device, stop());
  device.reset_kernel_times();
  meter_seconds_ = seconds() - before;
}

Map Session::read_map(const std::string& file) {
  const TraceStage stage(trace_, "read the map");
  expect_map("this command", file);
  return qjulia::read_map(file, stop());
}

TriangleMesh Session::read_mesh(const std::string& file, const std::stop_token& stop) {
  const TraceStage stage(trace_, "read the mesh");
  auto [mesh, report] = read_and_inspect_mesh(file, stop);
  for (const std::string& warning : report.warnings()) {
    console.warn(fmt::format("{}: {}", file, warning));
  }
  return mesh;
}

void Session::expect_right_results(const Device& device, const TrustedDevice& wanted) {
  if (wanted.is_trusted || device.info().kind == DeviceKind::cpu) return;
  std::optional<profiling::LaunchCounter> apart;
  if (counter_) apart.emplace();
  const auto report = first_self_test(device, monitor());
  apart.reset();
  if (!report) return;
  device.reset_kernel_times();
  for (const ProgramCheck& check : report->checks) {
    if (check.has_passed()) continue;
    const std::string what =
        check.problem.empty()
            ? fmt::format("it computes wrongly ({}: off by {:.1e}, and at most {:.1e} is allowed)",
                          check.compared, check.difference, check.tolerance)
            : check.problem.substr(0, check.problem.find('\n'));
    console.warn(fmt::format(
        "{} failed the self-test of '{}': {}. Results of this device cannot be trusted; 'qjulia "
        "doctor' tests all programs, and --trust-device leaves this test out",
        check.program, device.info().name, what));
  }
  if (report->has_passed()) console.detail("the device passed its first self-test");
}

Device Session::open_device(const TrustedDevice& wanted) {
  if (place_.device) {
    job_.device = device_json(place_.device->info());
    return *place_.device;
  }
  expect_room_for_drivers();
  const auto [device, warning] = with_cached_tuning(Device::choose(wanted));
  if (!warning.empty()) console.warn(warning);
  const bool tuned = device.is_tuned(Precision::single) || device.is_tuned(Precision::dbl);
  console.note(fmt::format(
      "device: {}{}{}", describe(device.info()), tuned ? " (tuned)" : "",
      device.has_own_layout() ? "" : fmt::format(", {} layout", to_string(device.layout()))));
  if (const std::string fault = known_fault(device.info()); !fault.empty()) console.warn(fault);
  expect_right_results(device, wanted);
  job_.device = device_json(device.info());
  if (trace_ && interrupts_) {
    start_meter(device);
    untraced_wait_ = device.wait_time();
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
  console.detail(describe(device.wait_time()));
  console.detail(describe(base::build_total()));
}

std::string busy_text(const std::vector<std::string>& signs) {
  return fmt::format(
      "the machine was busy: {}. Seconds are too long; shares of the limit still hold, and 'not "
      "now' stands where they cannot be judged",
      fmt::join(signs, "; "));
}

std::string describe(const WaitTime& waited) {
  return fmt::format(
      "waited {:.3f} s for the device, of which {:.3f} s asleep; waiting took {:.3f} s of "
      "processor time",
      waited.seconds, waited.slept_seconds, waited.processor_seconds);
}

std::string describe(const DeviceInfo& info) {
  return fmt::format("{}:{} {} {}", info.platform, info.index, to_string(info.kind), info.name);
}

}  // namespace qjulia::tools
