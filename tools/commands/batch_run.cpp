/// qjulia batch run: many meshes in, many maps out.

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>

#include "commands/batch_commands.hpp"
#include "commands/batch_display.hpp"
#include "commands/fit_worker.hpp"
#include "commands/launched_ranks.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/device/tuning_cache.hpp"

namespace qjulia::tools {
namespace {

struct BatchArguments {
  std::string manifest, folder;
  TrustedDevice device;
  int jobs = 1;
  bool resume = false, retry_failed = false;
};

/// One fit leaves a CPU's cores idle a sixth of the time; two at once leave little of it.
constexpr int kBusyJobs = 2;

int jobs_in(const std::string& text) {
  if (text == "auto") return kBusyJobs;
  const int jobs = whole_number(text);
  if (jobs < 1 || jobs > 1024) {
    throw InputError(text + " is out of range; give auto, or a number from 1 to 1024");
  }
  return jobs;
}

/// This rank's queues: `jobs` for a CPU, one for any other device.
std::vector<batch::BatchDevice> batch_devices(const BatchArguments& arguments,
                                              const LaunchedRanks& ranks, Session& session) {
  std::vector<batch::BatchDevice> devices;
  for (const DeviceInfo& info : devices_of(ranks, arguments.device)) {
    const int queues = info.kind == DeviceKind::cpu ? arguments.jobs : 1;
    for (int i = 0; i < queues; ++i) {
      const DeviceChoice choice{fmt::format("{}:{}", info.platform, info.index),
                                arguments.device.layout};
      // One queue: tested once.
      if (info.kind != DeviceKind::cpu && !arguments.device.is_trusted) {
        session.expect_right_results(with_cached_tuning(Device::choose(choice)).device,
                                     arguments.device);
      }
      devices.push_back({describe(info), [choice] {
                           return FitWorker(with_cached_tuning(Device::choose(choice)));
                         }});
    }
  }
  return devices;
}

/// What the folder says, and what could not be written there.
std::vector<batch::EntryStatus> final_states(const std::filesystem::path& folder,
                                             const std::vector<batch::EntryStatus>& unsaved) {
  auto entries = batch::read_batch(folder, false);
  for (const batch::EntryStatus& status : unsaved) {
    const auto found = std::ranges::find(entries, status.name, &batch::EntryStatus::name);
    if (found != entries.end()) *found = status;
  }
  return entries;
}

/// @param settled entries that are done or have failed, as this run has found or made them.
int finish(const BatchArguments& arguments, std::size_t settled,
           const std::vector<batch::EntryStatus>& unsaved, Session& session) {
  const auto entries = final_states(arguments.folder, unsaved);
  for (const batch::EntryStatus& status : unsaved) {
    if (status.state != batch::EntryState::done) continue;
    session.console.warn(
        fmt::format("{} is done, and --resume does it again, since its status is not kept: {}",
                    status.name, status.error));
  }
  std::string unwritten;
  try {
    batch::write_summary(arguments.folder, entries);
  } catch (const OutputError& error) {
    unwritten = error.what();
  }
  std::string text = totals(entries) + fmt::format("; {:.1f} s", session.seconds());
  for (const batch::EntryStatus& entry : entries) {
    if (entry.state != batch::EntryState::done) text += "\n  " + describe(entry);
  }
  const std::size_t done = count(entries, batch::EntryState::done);
  const std::size_t finished = done + count(entries, batch::EntryState::failed);
  const std::size_t not_again = finished - std::min(finished, settled);
  if (not_again > 0) {
    text += fmt::format(
        "\n  {} from an earlier run and not redone: --resume keeps them, and a run without "
        "it redoes them",
        not_again);
  }
  if (unwritten.empty()) {
    const std::filesystem::path folder = arguments.folder;
    text += fmt::format("\nsummary: {}, .csv; page: {}", (folder / "summary.json").string(),
                        (folder / "index.html").string());
  }
  nlohmann::json json = report_json(entries);
  json["seconds"] = session.seconds();
  json["folder"] = arguments.folder;
  session.console.summary(text, json);
  if (!unwritten.empty()) throw OutputError(unwritten);
  if (done == entries.size() && not_again == 0) return kDone;
  if (!session.stop().stop_requested()) return kFailed;
  session.console.note("interrupted; --resume does the rest");
  return kInterrupted;
}

/// What happens before the first fit; rank 0 does what is to be done once.
struct BatchStart {
  batch::Manifest manifest;
  batch::BatchOptions options;
  std::vector<batch::BatchDevice> devices;
  std::optional<batch::FolderLock> lock;  ///< rank 0's
};

BatchStart start(const BatchArguments& arguments, const LaunchedRanks& ranks, Session& session) {
  BatchStart start{read_manifest(arguments.manifest, arguments.resume, session.stop()), {}, {}, {}};
  start.options = {arguments.folder, arguments.resume, arguments.retry_failed, fit_key, settings};
  start.devices = batch_devices(arguments, ranks, session);
  const std::string who = ranks.size() > 1 ? fmt::format("rank {}: ", ranks.rank()) : "";
  for (const batch::BatchDevice& device : start.devices) {
    session.console.note(fmt::format("{}device: {}", who, device.name));
  }
  if (ranks.rank() == 0) {
    start.lock.emplace(batch::prepare_batch(start.manifest, start.options));
  }
  return start;
}

int run_batch(const BatchArguments& arguments, Session& session) {
  LaunchedRanks ranks;
  std::optional<BatchStart> started;
  if (const int code = together(ranks, [&]() -> int {
        started.emplace(start(arguments, ranks, session));
        return kDone;
      })) {
    return code;
  }
  std::size_t settled = 0;
  std::vector<batch::EntryStatus> unsaved;
  const int code = together(ranks, [&]() -> int {
    const auto& [manifest, options, devices, lock] = *started;
    BatchDisplay display(session.console, manifest.entries.size());
    unsaved = batch::run_batch(
        manifest, devices, options,
        [&](const batch::BatchEvent& event) {
          using EventKind = batch::BatchEvent::Kind;
          if (event.kind == EventKind::done || event.kind == EventKind::failed) ++settled;
          display.show(event);
        },
        session.stop(), &ranks);
    return unsaved.empty() ? kDone : kFailed;
  });
  const int finished = together(ranks, [&]() -> int {
    return ranks.rank() == 0 ? finish(arguments, settled, unsaved, session) : kDone;
  });
  return std::max(code, finished);
}

void describe_batch(Command command, BatchArguments& a) {
  add_manifest(command, a.manifest);
  command.output(a.folder, "FOLDER", "Folder for everything the batch writes").offers_folders();
  const Option resume =
      command.flag("--resume", a.resume,
                   "Keep what is complete for the same meshes and options, and do the rest");
  command.flag("--retry-failed", a.retry_failed, "With --resume: try again what failed")
      .needs(resume);
  command
      .word(
          "--jobs", "NUMBER|auto", [&a](const std::string& text) { a.jobs = jobs_in(text); },
          "Fits side by side on a CPU, 1 to 1024, or 'auto': 2, which keep it busy; a GPU "
          "always does one at a time")
      .default_text("1")
      .offers({"auto"});
  add_device_to_use(command, a.device);
}

}  // namespace

void add_batch_run(CommandLine& program, ChosenCommand& chosen) {
  add_command(program, chosen,
              {"batch run", "Fit the meshes of a manifest", R"(A manifest:
  [defaults]
  factors = 331               any option of 'qjulia fit', with _ for -
  picture = true              and surface = true: what to make of each map
  [[fit]]
  mesh = "shapes/*.ply"       a path or glob, from the manifest's folder
  [[fit]]
  mesh = "bunny.obj"
  name = "bunny-fine"
  factors = 1000
  [[sweep]]                   a fit for each mesh and each combination of listed values
  mesh = "*.obj"
  seed = [1, 2, 3]
  compare = [1, 6]            measure each map against its mesh at these n
Examples:
  qjulia batch run shapes.toml -o results
  qjulia batch run shapes.toml -o results --resume     after whatever has happened
  mpirun -np 4 qjulia batch run shapes.toml -o results   on the machines given to mpirun
'--device all' uses every device there is. Exit code 1 while any entry is not done.)",
               /*can_trace=*/false},
              describe_batch, run_batch);
}

}  // namespace qjulia::tools
