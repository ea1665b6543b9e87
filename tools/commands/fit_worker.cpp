#include "commands/fit_worker.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "base/fnv_hash.hpp"
#include "base/output_gate.hpp"
#include "commands/batch_commands.hpp"
#include "commands/manifest_options.hpp"
#include "describe/files.hpp"
#include "describe/provenance.hpp"
#include "jobs/job_run.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/base/version.hpp"
#include "qjulia/map/map_file.hpp"
#include "qjulia/mesh/point_cache.hpp"
#include "qjulia/surface/compare.hpp"
#include "qjulia/surface/figures.hpp"
#include "report/report.hpp"

namespace qjulia::tools {
namespace {

/// A fit's options, the same from wherever the batch is started: a schedule's hash says enough.
nlohmann::json without_schedule_folder(nlohmann::json options) {
  options["schedule"] =
      std::filesystem::path(options["schedule"].get<std::string>()).filename().string();
  return options;
}

/// A job's options, the same from wherever the batch is started: files by names and hashes.
nlohmann::json without_folders(nlohmann::json options) {
  for (nlohmann::json& value : options) {
    if (!value.is_string()) continue;
    const std::filesystem::path path = value.get<std::string>();
    std::error_code ignored;
    if (path.is_absolute() && std::filesystem::is_regular_file(path, ignored)) {
      value = name_of(path) + " " + file_hash(path);
    }
  }
  return options;
}

/// Every option of an entry's fit but the map that it starts from.
FitOptions entry_options(const batch::BatchEntry& entry) {
  constexpr int kShorter = 10;  // of a frame that follows another
  FitOptions options = fit_options(entry.options);
  if (entry.follows.empty()) return options;
  options.schedule = "follow";
  if (options.max_evaluations) {
    options.max_evaluations = std::max(1, *options.max_evaluations / kShorter);
  }
  return options;
}

/// The options with what the frame before gives: the map to start from, its number of factors, its
/// detail and its upright, unless they are given as numbers.
FitOptions started_at(FitOptions options, Map before) {
  options.max_factors.reset();
  if (options.factors) options.factors = static_cast<int>(before.dynamics.factors.size());
  if (std::holds_alternative<DetailWord>(options.detail) && before.frame.detail) {
    options.detail = *before.frame.detail;
  }
  if (!options.up) options.up = before.frame.up;
  options.initial = std::move(before);
  return options;
}

/// What tells whether a frame of a point cache is the same, whatever the other frames are.
std::string frame_hash(const std::filesystem::path& cache, std::size_t frame) {
  const TriangleMesh mesh = read_frame(cache, frame);
  base::FnvHash hash;
  hash.add(mesh.vertices.size());
  for (const Eigen::Vector3d& x : mesh.vertices) {
    for (const double coordinate : x) hash.add(coordinate);
  }
  for (const Triangle& triangle : mesh.triangles) {
    for (const std::uint32_t corner : triangle) hash.add(corner);
  }
  return hash.text();
}

/// The hash of the mesh that an entry fits. @throws InputError where it cannot be read
std::string mesh_hash(const batch::BatchEntry& entry) {
  return entry.frame ? frame_hash(entry.mesh, *entry.frame) : file_hash(entry.mesh);
}

}  // namespace

FitWorker::FitWorker(CachedTuning kept)
    : device_(std::move(kept.device)), tuning_warning_(std::move(kept.warning)) {}

batch::EntryResult FitWorker::operator()(const batch::BatchEntry& entry,
                                         const std::filesystem::path& folder,
                                         const batch::EntryMonitor& monitor) const {
  FitOptions options = entry_options(entry);
  std::filesystem::path before;
  if (!entry.follows.empty()) {
    before = folder / (entry.follows + ".qjulia.json");
    options = started_at(std::move(options), read_map(before, monitor.stop));
  }
  FitOrigin origin = origin_of(options, fit_job(entry.mesh, options, before));
  origin.options = without_schedule_folder(std::move(origin.options));
  if (entry.frame) {
    origin.mesh["frame"] = *entry.frame + 1;
    origin.mesh["fnv1a64"] = mesh_hash(entry);
  }
  options.observer.on_evaluation = monitor.on_energy;
  const auto [mesh, mesh_report] =
      entry.frame ? read_and_inspect_frame(entry.mesh, *entry.frame, monitor.stop)
                  : read_and_inspect_mesh(entry.mesh, monitor.stop);
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
  nlohmann::json made = without_times(provenance(origin, device_, result));
  if (entry.frame) made.erase("jobs");  // 'fit' reads no frame of a point cache
  result.map.provenance = made;
  const std::filesystem::path map = file(".qjulia.json");
  write_map(result.map, map);
  auto warnings = mesh_report.warnings();
  for (const auto& job : {entry.outputs.surface, entry.outputs.picture}) {
    if (!job) continue;
    const Said said = run_job(entry_job(*job, map), file(job->extension).string(),
                              {device_, static_cast<const ProgressMonitor&>(monitor)});
    warnings.insert(warnings.end(), said.warnings.begin(), said.warnings.end());
  }
  if (entry.outputs.report) {
    const report::FitReport report =
        report::make_report(device_, mesh, result, entry.name, monitor);
    report::write_report(report, file(".report.html"));
  }
  if (!entry.outputs.compare.empty()) {
    entry_result.figures["comparisons"] = comparisons(entry, mesh, result.map, monitor);
  }
  base::OutputGate::pass();
  std::filesystem::remove(folder / (entry.name + ".checkpoint"));

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

FitResult FitWorker::fit_resumable(const TriangleMesh& mesh, FitOptions options,
                                   const std::filesystem::path& checkpoint,
                                   const ProgressMonitor& monitor) const {
  options.checkpoint = checkpoint;
  options.resume = true;
  try {
    return fit(device_, mesh, options, monitor);
  } catch (const InputError&) {
    // The checkpoint may be of other options or another device: then the fit starts afresh.
    base::OutputGate::pass();
    if (!std::filesystem::remove(checkpoint)) throw;
    return fit(device_, mesh, options, monitor);
  }
}

nlohmann::json FitWorker::comparisons(const batch::BatchEntry& entry, const TriangleMesh& mesh,
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

batch::FitKey fit_key(const batch::BatchEntry& entry) {
  const batch::BatchOutputs& outputs = entry.outputs;
  std::string rest = fmt::format("{}", outputs.report);
  for (const auto& job : {outputs.surface, outputs.picture}) {
    rest += job ? fmt::format(" {} {} {}", job->command, job->extension,
                              without_folders(job->options).dump())
                : " -";
  }
  if (!outputs.compare.empty()) {
    rest += fmt::format(" {} at {}", fmt::join(outputs.compare, ","), outputs.compare_resolution);
  }
  const nlohmann::json options = without_schedule_folder(to_json(entry_options(entry)));
  batch::FitKey key{{}, text_hash(options.dump() + rest)};
  try {
    key.inputs = mesh_hash(entry);
  } catch (const InputError&) {
    // Reading the mesh will say so.
  }
  return key;
}

nlohmann::json settings(const batch::BatchEntry& entry) {
  nlohmann::json all = without_schedule_folder(to_json(entry_options(entry)));
  all["version"] = version();
  return all;
}

}  // namespace qjulia::tools
