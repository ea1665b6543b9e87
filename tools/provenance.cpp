#include "provenance.hpp"

#include <cmath>

#include "files.hpp"
#include "qjulia/version.hpp"

namespace qjulia::tools {
namespace {

/// For programs: does not change with the wording for people.
const char* key(StopReason reason) {
  switch (reason) {
    case StopReason::schedule_done:
      return "schedule_done";
    case StopReason::evaluations:
      return "evaluations";
    case StopReason::time_limit:
      return "time_limit";
    case StopReason::interrupted:
      return "interrupted";
    case StopReason::converged:
      break;
  }
  return "converged";
}

}  // namespace

nlohmann::json to_json(const FitOptions& options) {
  nlohmann::json json = {{"factors", options.factors},
                         {"detail", options.detail},
                         {"seed", options.seed},
                         {"time_limit", nullptr},
                         {"max_evaluations", options.max_evaluations},
                         {"unknowns", options.unknowns == Unknowns::all ? "all" : "exponents"},
                         {"precision", options.precision == Precision::dbl ? "double" : "single"},
                         {"schedule", options.schedule}};
  if (std::isfinite(options.time_limit)) json["time_limit"] = options.time_limit;
  return json;
}

nlohmann::json to_json(const StageReport& stage) {
  return {{"name", stage.name},
          {"evaluations", stage.evaluations},
          {"energy_before", stage.energy_before},
          {"energy_after", stage.energy_after},
          {"iou", stage.iou},
          {"seconds", stage.seconds}};
}

nlohmann::json final_figures(const FitResult& result) {
  if (result.stages.empty()) return {{"energy", nullptr}, {"iou", nullptr}};
  return {{"energy", result.stages.back().energy_after}, {"iou", result.stages.back().iou}};
}

nlohmann::json provenance(const std::filesystem::path& mesh_path, const FitOptions& options,
                          const DeviceInfo& device, const FitResult& result) {
  nlohmann::json stages = nlohmann::json::array();
  for (const StageReport& stage : result.stages) stages.push_back(to_json(stage));
  return {{"program", {{"name", "qjulia"}, {"version", version()}}},
          {"mesh", {{"name", mesh_path.filename().string()}, {"fnv1a64", file_hash(mesh_path)}}},
          {"options", to_json(options)},
          {"device",
           {{"name", device.name},
            {"platform", device.platform_name},
            {"driver", device.driver_version}}},
          {"stages", stages},
          {"metrics", final_figures(result)},
          {"evaluations", result.evaluations},
          {"seconds", result.seconds},
          {"stopped", key(result.stopped)},
          {"warnings", result.warnings}};
}

}  // namespace qjulia::tools
