/// qjulia batch run: many meshes in, many maps out.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "base/kernel_cache.hpp"
#include "batch/energy_meter.hpp"
#include "batch/event_log.hpp"
#include "batch/shard.hpp"
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
  std::optional<batch::Shard> shard;
  std::string events, metrics;
  int rank_timeout = 60;  ///< seconds
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

int timeout_in(const std::string& text) {
  constexpr int kDay = 86400;
  const int seconds = whole_number(text);
  if (seconds < 1 || seconds > kDay) {
    throw InputError(fmt::format("{} is out of range; give seconds from 1 to {}", text, kDay));
  }
  return seconds;
}

/// Null where the system does not say what the device takes.
std::shared_ptr<batch::EnergyMeter> energy_meter(const DeviceInfo& info) {
  auto counters = info.kind == DeviceKind::cpu ? batch::cpu_energy_counters()
                                               : batch::gpu_energy_counters(info.pci_address);
  if (counters.empty()) return nullptr;
  return std::make_shared<batch::EnergyMeter>(std::move(counters));
}

/// This rank's queues: `jobs` for a CPU, one for any other device.
std::vector<batch::BatchDevice> batch_devices(const BatchArguments& arguments,
                                              const LaunchedRanks& ranks, Session& session) {
  std::vector<batch::BatchDevice> devices;
  for (const DeviceInfo& info : devices_of(ranks, arguments.device)) {
    const int queues = info.kind == DeviceKind::cpu ? arguments.jobs : 1;
    const auto energy = energy_meter(info);
    for (int i = 0; i < queues; ++i) {
      const DeviceChoice choice{fmt::format("{}:{}", info.platform, info.index),
                                arguments.device.layout};
      // One queue: tested once.
      if (info.kind != DeviceKind::cpu && !arguments.device.is_trusted) {
        session.expect_right_results(with_cached_tuning(Device::choose(choice)).device,
                                     arguments.device);
      }
      devices.push_back({describe(info),
                         [choice] { return FitWorker(with_cached_tuning(Device::choose(choice))); },
                         energy});
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

/// What a run writes where FILE is asked for.
std::filesystem::path own_file(const std::string& file, const std::optional<batch::Shard>& shard) {
  return shard ? batch::shard_file(file, *shard) : std::filesystem::path(file);
}

/// The files for programs that watch the batch.
struct Watchers {
  std::optional<batch::EventLog> log;
  std::optional<batch::MetricsFile> metrics;  ///< rank 0's

  Watchers(const BatchArguments& arguments, const batch::Manifest& manifest, int rank) {
    if (!arguments.events.empty()) {
      log.emplace(own_file(arguments.events, manifest.shard), arguments.resume || rank > 0, rank);
      nlohmann::json began{{"entries", manifest.entries.size()}, {"resume", arguments.resume}};
      if (manifest.shard) {
        began["shard"] = fmt::format("{}/{}", manifest.shard->number, manifest.shard->count);
      }
      log->write("batch_started", std::move(began));
    }
    if (rank == 0 && !arguments.metrics.empty()) {
      metrics.emplace(own_file(arguments.metrics, manifest.shard), manifest.entries.size(),
                      manifest.shard);
      metrics->write();
    }
  }

  /// The batch goes on where one of the files can no longer be written.
  void note(const batch::BatchEvent& event) {
    if (log) log->write(event);
    if (!metrics) return;
    try {
      metrics->note(event);
    } catch (const OutputError&) {
      // `end` writes it again, and tells of what is wrong then.
    }
  }

  void end(Session& session) {
    if (log && log->has_failed()) {
      session.console.warn("--events: lines are missing, since they could not be written");
    }
    if (!metrics) return;
    try {
      metrics->write();
    } catch (const OutputError& error) {
      session.console.warn(fmt::format("--prometheus: {}", error.what()));
    }
  }
};

/// @param settled entries that are done or have failed, as this run has found or made them.
int finish(const std::filesystem::path& folder, std::size_t settled,
           const std::vector<batch::EntryStatus>& unsaved, Watchers& watchers, Session& session) {
  const auto entries = final_states(folder, unsaved);
  for (const batch::EntryStatus& status : unsaved) {
    if (status.state != batch::EntryState::done) continue;
    session.console.warn(
        fmt::format("{} is done, and --resume does it again, since its status is not kept: {}",
                    status.name, status.error));
  }
  std::string unwritten;
  try {
    batch::write_summary(folder, entries);
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
    text += fmt::format("\nsummary: {}, .csv; page: {}", (folder / "summary.json").string(),
                        (folder / "index.html").string());
  }
  nlohmann::json json = report_json(entries);
  json["seconds"] = session.seconds();
  json["folder"] = folder.string();
  if (watchers.log) {
    watchers.log->write("batch_ended", {{"entries", entries.size()},
                                        {"done", done},
                                        {"failed", count(entries, batch::EntryState::failed)},
                                        {"seconds", session.seconds()}});
  }
  watchers.end(session);
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

/// PoCL's cache is not safe to fill by several processes, as shards are that start together.
void use_own_kernel_cache(const batch::Shard& shard) {
  if (std::getenv("POCL_CACHE_DIR") != nullptr) return;
  const auto own = batch::shard_folder(base::kernel_cache().folder, shard);
  std::error_code ignored;  // PoCL says what is wrong with it
  std::filesystem::create_directories(own, ignored);
  ::setenv("POCL_CACHE_DIR", own.c_str(), 1);
}

std::filesystem::path folder_of(const BatchArguments& arguments, const batch::Manifest& manifest) {
  return manifest.shard ? batch::shard_folder(arguments.folder, *manifest.shard)
                        : std::filesystem::path(arguments.folder);
}

/// The shard that is asked for, or that a scheduler's array says. @throws InputError
std::optional<batch::Shard> wanted_shard(const BatchArguments& arguments, Session& session) {
  if (arguments.shard) {
    return arguments.shard->count > 1 ? arguments.shard : std::nullopt;
  }
  const auto scheduled = batch::scheduled_shard([](const char* name) { return std::getenv(name); });
  if (!scheduled) return std::nullopt;
  session.console.note(fmt::format("shard {} of {}, as {} says; --shard 1/1 does the whole batch",
                                   scheduled->shard.number, scheduled->shard.count,
                                   scheduled->variable));
  return scheduled->shard;
}

void check_watched_files(const BatchArguments& arguments, const std::optional<batch::Shard>& shard,
                         Session& session) {
  std::vector<base::Output> outputs;
  if (!arguments.events.empty())
    outputs.push_back({"--events", own_file(arguments.events, shard), {".jsonl"}});
  if (!arguments.metrics.empty())
    outputs.push_back({"--prometheus", own_file(arguments.metrics, shard), {".prom"}});
  if (!outputs.empty()) session.check_outputs({{arguments.manifest}, outputs});
}

BatchStart start(const BatchArguments& arguments, const LaunchedRanks& ranks, Session& session) {
  const auto shard = wanted_shard(arguments, session);
  if (ranks.rank() == 0) check_watched_files(arguments, shard, session);
  BatchStart start{read_manifest(arguments.manifest, arguments.resume, session.stop()), {}, {}, {}};
  if (shard) {
    batch::check_division(arguments.folder, *shard);
    batch::keep_shard(start.manifest, *shard);
    use_own_kernel_cache(*shard);
  }
  start.options = {folder_of(arguments, start.manifest), arguments.resume, arguments.retry_failed,
                   fit_key, settings};
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
  ranks.set_patience(std::chrono::seconds(arguments.rank_timeout));
  std::optional<BatchStart> started;
  if (const int code = together(ranks, [&]() -> int {
        started.emplace(start(arguments, ranks, session));
        return kDone;
      })) {
    return code;
  }
  const auto& manifest = started->manifest;
  const auto& options = started->options;
  const auto& devices = started->devices;
  std::size_t settled = 0;
  std::vector<batch::EntryStatus> unsaved;
  std::optional<Watchers> watchers;
  // Before the rounds, which every rank has to join; rank 0 first, since it may empty the file.
  for (const bool is_first : {true, false}) {
    if (const int code = together(ranks, [&]() -> int {
          if ((ranks.rank() == 0) == is_first) {
            watchers.emplace(arguments, manifest, ranks.rank());
          }
          return kDone;
        })) {
      return code;
    }
  }
  const int code = together(ranks, [&]() -> int {
    BatchDisplay display(session.console, manifest.entries.size());
    unsaved = batch::run_batch(
        manifest, devices, options,
        [&](const batch::BatchEvent& event) {
          using EventKind = batch::BatchEvent::Kind;
          if (event.kind == EventKind::done || event.kind == EventKind::failed) ++settled;
          display.show(event);
          watchers->note(event);
        },
        session.stop(), &ranks);
    return unsaved.empty() ? kDone : kFailed;
  });
  const int finished = together(ranks, [&]() -> int {
    if (ranks.rank() == 0) return finish(options.folder, settled, unsaved, *watchers, session);
    watchers->end(session);
    return kDone;
  });
  ranks.leave(std::max(code, finished));
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
  command.word(
      "--shard", "I/N", [&a](const std::string& text) { a.shard = batch::shard_of(text); },
      "Only the fits I, I + N, I + 2N … of the manifest, in FOLDER/shard-I-of-N; a sequence counts "
      "as one fit, so that one shard does all of its frames. 'batch merge' puts the shards "
      "together. Default: the whole batch, and in an array of Slurm the shard that its variables "
      "say");
  command
      .file("--events", a.events, "FILE.jsonl",
            "Also write what happens, when it happens, a JSON object a line: starts, ends, errors, "
            "and each second the energy of every fit that runs. With --resume, lines are added. "
            "Shard "
            "I of N writes FILE-I-of-N.jsonl")
      .offers_files({".jsonl"});
  command
      .file("--prometheus", a.metrics, "FILE.prom",
            "Also keep states, seconds, memory, joules and energies of fits of entries in a file "
            "of metrics, for "
            "the textfile collector of Prometheus's node exporter. Shard I of N writes "
            "FILE-I-of-N.prom")
      .offers_files({".prom"});
  command
      .word(
          "--rank-timeout", "SECONDS",
          [&a](const std::string& text) { a.rank_timeout = timeout_in(text); },
          "Under mpirun, give up a rank that has not answered for SECONDS (1 to 86400) while "
          "entries run; others do its entries. If rank 0 is lost, the batch ends after twice that "
          "time")
      .default_text("60");
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
  qjulia batch run shapes.toml -o results --shard 2/3    a third of it; see 'batch merge'
'--device all' uses every device there is. Exit code 1 while any entry is not done.)",
               /*can_trace=*/false},
              describe_batch, run_batch);
}

}  // namespace qjulia::tools
