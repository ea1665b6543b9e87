#include "fit_worker.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "files.hpp"
#include "fit_options.hpp"
#include "provenance.hpp"
#include "qjulia/error.hpp"
#include "qjulia/figures.hpp"
#include "qjulia/map_file.hpp"
#include "qjulia/picture.hpp"
#include "qjulia/surface.hpp"
#include "qjulia/tuning_cache.hpp"
#include "report/report.hpp"

namespace qjulia::tools {
namespace {

/// The batch's maps are the same bytes wherever and whenever they are made: times stand in the
/// status files.
nlohmann::json without_times(nlohmann::json provenance) {
  provenance.erase("seconds");
  for (nlohmann::json& stage : provenance["stages"]) stage.erase("seconds");
  return provenance;
}

class FitWorker final : public batch::BatchWorker {
 public:
  explicit FitWorker(CachedTuning kept)
      : device_(std::move(kept.device)), tuning_warning_(std::move(kept.warning)) {}

  batch::EntryResult run(const batch::BatchEntry& entry, const std::filesystem::path& folder,
                         const ProgressMonitor& monitor) override {
    const FitOptions options = checked_options(entry.options);
    MeshReport mesh_report;
    const TriangleMesh mesh = read_mesh(entry.mesh, &mesh_report, monitor.stop);
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
    result.map.provenance = without_times(provenance(entry.mesh, options, device_, result));
    write_map(result.map, file(".qjulia.json"));
    if (entry.outputs.surface) {
      write_mesh(surface(entry, result.map, monitor), file(*entry.outputs.surface), {},
                 result.map.up);
    }
    if (entry.outputs.picture) write_png(picture(entry, result.map, monitor), file(".png"));
    if (entry.outputs.report) {
      const report::FitReport report =
          report::make_report(device_, mesh, result, entry.name, {}, monitor);
      report::write_report(report, file(".report.html"));
    }
    std::filesystem::remove(folder / (entry.name + ".checkpoint"));

    auto warnings = mesh_report.warnings();
    if (!tuning_warning_.empty()) warnings.push_back(tuning_warning_);
    warnings.insert(warnings.end(), result.warnings.begin(), result.warnings.end());
    entry_result.figures = final_figures(result);
    entry_result.figures.update({{"factors", result.map.factors.size()},
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

  TriangleMesh surface(const batch::BatchEntry& entry, const RationalMap& map,
                       const ProgressMonitor& monitor) const {
    SurfaceOptions options;
    options.resolution = entry.outputs.surface_resolution;
    TriangleMesh mesh = extract_surface(device_, map, options, monitor);
    if (mesh.triangles.empty()) {
      throw Error("the set is empty, so there is no surface; try a smaller detail");
    }
    drop_loose_pieces(mesh);
    return mesh;
  }

  Image picture(const batch::BatchEntry& entry, const RationalMap& map,
                const ProgressMonitor& monitor) const {
    PictureOptions options;
    options.width = entry.outputs.picture_width;
    options.height = entry.outputs.picture_height;
    return render(device_, map, options, monitor);
  }

  Device device_;
  std::string tuning_warning_;
};

}  // namespace

batch::FitKey fit_key(const batch::BatchEntry& entry) {
  const batch::BatchOutputs& outputs = entry.outputs;
  const std::string rest = fmt::format(
      "{} {} {} {} {}x{}", outputs.report, outputs.surface.value_or("-"),
      outputs.surface ? outputs.surface_resolution : 0, outputs.picture,
      outputs.picture ? outputs.picture_width : 0, outputs.picture ? outputs.picture_height : 0);
  const FitOptions options = checked_options(entry.options);
  batch::FitKey key{{}, text_hash(to_json(options).dump() + rest)};
  try {
    key.inputs = file_hash(entry.mesh);
  } catch (const InputError&) {
    // Reading the mesh will say so.
  }
  return key;
}

std::unique_ptr<batch::BatchWorker> make_fit_worker(const std::string& device) {
  return std::make_unique<FitWorker>(with_cached_tuning(Device::choose(device)));
}

}  // namespace qjulia::tools
