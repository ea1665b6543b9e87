/// qjulia batch: many meshes in, many maps out.

#include "batch/batch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "batch_display.hpp"
#include "commands.hpp"
#include "files.hpp"
#include "fit_options.hpp"
#include "launched_ranks.hpp"
#include "provenance.hpp"
#include "qjulia/compare.hpp"
#include "qjulia/error.hpp"
#include "qjulia/figures.hpp"
#include "qjulia/map_file.hpp"
#include "qjulia/picture.hpp"
#include "qjulia/surface.hpp"
#include "qjulia/tuning_cache.hpp"
#include "qjulia/version.hpp"
#include "report/report.hpp"

namespace qjulia::tools {
namespace {

struct BatchArguments {
  std::string manifest, folder, status;
  TrustedDevice device;
  int jobs = 1;
  bool check = false, resume = false, retry_failed = false;
  std::vector<Option> all_but_status;  ///< all of this command's options but --status
};

/// A fit's options, the same from wherever the batch is started: a schedule's hash says enough.
nlohmann::json without_schedule_folder(nlohmann::json options) {
  options["schedule"] =
      std::filesystem::path(options["schedule"].get<std::string>()).filename().string();
  return options;
}

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

/// The batch's maps are the same bytes wherever and whenever they are made: times stand in the
/// status files.
nlohmann::json without_times(nlohmann::json provenance) {
  provenance.erase("seconds");
  for (nlohmann::json& stage : provenance["stages"]) stage.erase("seconds");
  return provenance;
}

/// What a batch does with an entry: a mesh in, a map, a surface and a picture out.
class FitWorker {
 public:
  explicit FitWorker(CachedTuning kept)
      : device_(std::move(kept.device)), tuning_warning_(std::move(kept.warning)) {}

  batch::EntryResult operator()(const batch::BatchEntry& entry, const std::filesystem::path& folder,
                                const ProgressMonitor& monitor) const {
    const FitOptions options = fit_options(entry.options);
    FitOrigin origin = origin_of(options, fit_job(entry.mesh, options));
    origin.options = without_schedule_folder(std::move(origin.options));
    const auto [mesh, mesh_report] = read_and_inspect_mesh(entry.mesh, monitor.stop);
    device_.reset_kernel_times();
    FitResult result = fit_resumable(mesh, options, folder / (entry.name + ".checkpoint"), monitor);
    if (result.stopped == StopReason::interrupted) throw Interrupted();

    double kernel_seconds = 0;
    for (const auto& [name, time] : device_.kernel_times()) kernel_seconds += time.seconds;
    batch::EntryResult entry_result;
    const auto file = [&](const std::string& extension) {
      entry_result.files.push_back(entry.name + extension);
      return folder / entry_result.files.back();
    };
    result.map.provenance = without_times(provenance(origin, device_, result));
    write_map(result.map, file(".qjulia.json"));
    if (entry.outputs.surface) {
      write_mesh(surface(entry, result.map, monitor), file(*entry.outputs.surface), {},
                 result.map.frame.up);
    }
    if (entry.outputs.picture) write_png(picture(entry, result.map, monitor), file(".png"));
    if (entry.outputs.report) {
      const report::FitReport report =
          report::make_report(device_, mesh, result, entry.name, monitor);
      report::write_report(report, file(".report.html"));
    }
    if (!entry.outputs.compare.empty()) {
      entry_result.figures["comparisons"] = comparisons(entry, mesh, result.map, monitor);
    }
    std::filesystem::remove(folder / (entry.name + ".checkpoint"));

    auto warnings = mesh_report.warnings();
    if (!tuning_warning_.empty()) warnings.push_back(tuning_warning_);
    warnings.insert(warnings.end(), result.warnings.begin(), result.warnings.end());
    entry_result.figures.update(final_figures(result));
    entry_result.figures.update({{"factors", result.map.dynamics.factors.size()},
                                 {"evaluations", result.evaluations},
                                 {"fit_seconds", result.seconds},
                                 {"kernel_seconds", kernel_seconds},
                                 {"stopped", result.map.provenance.json()["stopped"]},
                                 {"warnings", warnings}});
    return entry_result;
  }

 private:
  FitResult fit_resumable(const TriangleMesh& mesh, FitOptions options,
                          const std::filesystem::path& checkpoint,
                          const ProgressMonitor& monitor) const {
    options.checkpoint = checkpoint;
    options.resume = true;
    try {
      return fit(device_, mesh, options, monitor);
    } catch (const InputError&) {
      // The checkpoint may be of other options or another device: then the fit starts afresh.
      if (!std::filesystem::remove(checkpoint)) throw;
      return fit(device_, mesh, options, monitor);
    }
  }

  TriangleMesh surface(const batch::BatchEntry& entry, const Map& map,
                       const ProgressMonitor& monitor) const {
    SurfaceOptions options;
    options.resolution = entry.outputs.surface_resolution;
    TriangleMesh mesh = extract_surface(device_, map, options, monitor);
    if (mesh.triangles.empty()) {
      throw Error(has_points(device_, map, options, monitor.stop)
                      ? "the set is too thin for the surface's cells; give a higher "
                        "surface_resolution"
                      : "the set is empty, so there is no surface; try a smaller detail");
    }
    drop_loose_pieces(mesh);
    return mesh;
  }

  /// Figures at each n that the entry is compared at.
  nlohmann::json comparisons(const batch::BatchEntry& entry, const TriangleMesh& mesh,
                             const Map& map, const ProgressMonitor& monitor) const {
    std::map<int, FitMetrics> by_iterations;
    // The largest first: each comparison gives n = 1, too.
    std::vector<int> descending = entry.outputs.compare;
    std::ranges::reverse(descending);
    for (const int n : descending) {
      if (by_iterations.contains(n)) continue;
      CompareOptions options;
      options.resolution = entry.outputs.compare_resolution;
      options.iterations = n;
      options.limbs = true;
      for (const FitMetrics& metrics : compare(device_, map, mesh, options, monitor)) {
        by_iterations.emplace(metrics.iterations, metrics);
      }
    }
    nlohmann::json rows = nlohmann::json::array();
    for (const int n : entry.outputs.compare) rows.push_back(to_json(by_iterations.at(n)));
    return rows;
  }

  Image picture(const batch::BatchEntry& entry, const Map& map,
                const ProgressMonitor& monitor) const {
    PictureOptions options;
    options.width = entry.outputs.picture_width;
    options.height = entry.outputs.picture_height;
    return render(device_, map, options, monitor);
  }

  Device device_;
  std::string tuning_warning_;
};

/// Hashes of the mesh's bytes and of every option the results depend on.
batch::FitKey fit_key(const batch::BatchEntry& entry) {
  const batch::BatchOutputs& outputs = entry.outputs;
  std::string rest = fmt::format("{} {} {} {} {}x{}", outputs.report, outputs.surface.value_or("-"),
                                 outputs.surface ? outputs.surface_resolution : 0, outputs.picture,
                                 outputs.picture ? outputs.picture_width : 0,
                                 outputs.picture ? outputs.picture_height : 0);
  if (!outputs.compare.empty()) {
    rest += fmt::format(" {} at {}", fmt::join(outputs.compare, ","), outputs.compare_resolution);
  }
  const nlohmann::json options = without_schedule_folder(to_json(fit_options(entry.options)));
  batch::FitKey key{{}, text_hash(options.dump() + rest)};
  try {
    key.inputs = file_hash(entry.mesh);
  } catch (const InputError&) {
    // Reading the mesh will say so.
  }
  return key;
}

/// For the summary: every option, and the version of the program.
nlohmann::json settings(const batch::BatchEntry& entry) {
  nlohmann::json all = without_schedule_folder(to_json(fit_options(entry.options)));
  all["version"] = version();
  return all;
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

nlohmann::json report(const std::vector<batch::EntryStatus>& entries) {
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

int exit_code(const std::vector<batch::EntryStatus>& entries) {
  return count(entries, batch::EntryState::done) == entries.size() ? kDone : kFailed;
}

int show_status(const BatchArguments& arguments, Session& session) {
  std::string others;
  for (const Option& option : arguments.all_but_status) {
    if (option.given()) others += (others.empty() ? "" : ", ") + option.name();
  }
  if (!others.empty()) {
    throw InputError(fmt::format("--status only reports on a batch; leave out {}", others));
  }
  const auto entries = batch::read_batch(arguments.status, batch::is_locked(arguments.status));
  std::string text;
  for (const batch::EntryStatus& entry : entries) text += describe(entry) + '\n';
  session.console.result(text + totals(entries), report(entries));
  return exit_code(entries);
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
  nlohmann::json json = report(entries);
  json["seconds"] = session.seconds();
  json["folder"] = arguments.folder;
  session.console.summary(text, json);
  if (!unwritten.empty()) throw OutputError(unwritten);
  if (done == entries.size() && not_again == 0) return kDone;
  if (!session.interrupts.requested()) return kFailed;
  session.console.note("interrupted; --resume does the rest");
  return kInterrupted;
}

batch::Manifest read(const BatchArguments& arguments, const std::stop_token& stop) {
  if (arguments.manifest.empty()) {
    throw InputError("batch needs a MANIFEST, or --status with the folder of a batch");
  }
  if (arguments.retry_failed && !arguments.resume) {
    throw InputError("--retry-failed needs --resume; without it, everything is done again");
  }
  const batch::FitOptionsCheck check = [](const std::vector<batch::ManifestOption>& options) {
    fit_options(options);
  };
  return batch::read_manifest(arguments.manifest, check, arguments.resume, stop);
}

int check(const BatchArguments& arguments, Session& session) {
  const auto fits = read(arguments, session.interrupts.token()).entries.size();
  session.console.result(
      fmt::format("{}: {} fit{}, nothing wrong", arguments.manifest, fits, fits == 1 ? "" : "s"),
      {{"manifest", arguments.manifest}, {"fits", fits}});
  return kDone;
}

/// What happens before the first fit; rank 0 does what is to be done once.
struct BatchStart {
  batch::Manifest manifest;
  batch::BatchOptions options;
  std::vector<batch::BatchDevice> devices;
  std::optional<batch::FolderLock> lock;  ///< rank 0's
};

BatchStart start(const BatchArguments& arguments, const LaunchedRanks& ranks, Session& session) {
  BatchStart start{read(arguments, session.interrupts.token()), {}, {}, {}};
  if (arguments.folder.empty()) throw InputError("batch needs -o, the folder to write to");
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
  if (!arguments.status.empty()) return show_status(arguments, session);
  if (arguments.check) return check(arguments, session);
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
          using Kind = batch::BatchEvent::Kind;
          if (event.kind == Kind::done || event.kind == Kind::failed) ++settled;
          display.show(event);
        },
        session.interrupts.token(), &ranks);
    return unsaved.empty() ? kDone : kFailed;
  });
  const int finished = together(ranks, [&]() -> int {
    return ranks.rank() == 0 ? finish(arguments, settled, unsaved, session) : kDone;
  });
  return std::max(code, finished);
}

void describe_batch(Command command, BatchArguments& a) {
  a.all_but_status = {
      command.file("MANIFEST", a.manifest, "", "What to fit: a TOML file, as in the example")
          .offers_files({".toml"}),
      command.file("-o,--output", a.folder, "FOLDER", "Folder for everything the batch writes")
          .offers_folders(),
      command.flag("--check", a.check, "Only say what is wrong with the manifest"),
      command.flag("--resume", a.resume,
                   "Keep what is complete for the same meshes and options, and do the rest"),
      command.flag("--retry-failed", a.retry_failed, "With --resume: try again what failed"),
      command
          .word(
              "--jobs", "NUMBER|auto", [&a](const std::string& text) { a.jobs = jobs_in(text); },
              "Fits side by side on a CPU, 1 to 1024, or 'auto': 2, which keep it busy; a GPU "
              "always does one at a time")
          .default_text("1")
          .offers({"auto"})};
  command
      .file("--status", a.status, "FOLDER",
            "Only report the progress of the batch in this folder; the exit code is 1 until every "
            "entry is done")
      .offers_folders();
  const auto of_device = add_device_to_use(command, a.device);
  a.all_but_status.insert(a.all_but_status.end(), of_device.begin(), of_device.end());
}

}  // namespace

void add_batch(CommandLine& program, ChosenCommand& chosen) {
  add_command(program, chosen,
              {"batch", "Fit many meshes, resumable after any interruption", R"(A manifest:
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
  qjulia batch shapes.toml -o results
  qjulia batch shapes.toml -o results --resume     after whatever has happened
  qjulia batch --status results
  mpirun -np 4 qjulia batch shapes.toml -o results   on the machines given to mpirun
'--device all' uses every device there is. Exit code 1 while any entry is not done.)",
               /*can_trace=*/false},
              describe_batch, run_batch);
}

}  // namespace qjulia::tools
