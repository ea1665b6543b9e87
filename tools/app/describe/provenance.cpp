#include "describe/provenance.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/setting_json.hpp"
#include "base/text.hpp"
#include "describe/files.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/base/version.hpp"
#include "qjulia/fit/fit_settings.hpp"
#include "qjulia/picture/picture_settings.hpp"

namespace qjulia::tools {
namespace {

/// For programs: they do not change with the wording for people.
constexpr std::array<std::pair<StopReason, const char*>, 6> kStopKeys{
    {{StopReason::schedule_done, "schedule_done"},
     {StopReason::evaluations, "evaluations"},
     {StopReason::time_limit, "time_limit"},
     {StopReason::target_iou, "target_iou"},
     {StopReason::interrupted, "interrupted"},
     {StopReason::converged, "converged"}}};

const char* key(StopReason reason) {
  return std::ranges::find(kStopKeys, reason, &std::pair<StopReason, const char*>::first)->second;
}

StopReason stop_reason(const std::string& key) {
  for (const auto& [reason, name] : kStopKeys) {
    if (key == name) return reason;
  }
  throw InputError(fmt::format("'{}' is no reason to stop", key));
}

/// A number, or null for one that is not finite.
double number(const nlohmann::json& json) {
  return json.is_null() ? std::numeric_limits<double>::quiet_NaN() : json.get<double>();
}

nlohmann::json stage_json(const StageReport& stage) {
  return {{"name", stage.name},
          {"evaluations", stage.evaluations},
          {"energy_before", stage.energy_before},
          {"energy_after", stage.energy_after},
          {"iou", stage.iou},
          {"iterations", stage.iterations},
          {"seconds", stage.seconds}};
}

StageReport stage_from(const nlohmann::json& j) {
  StageReport stage;
  stage.name = j.at("name");
  stage.evaluations = j.at("evaluations");
  stage.energy_before = number(j.at("energy_before"));
  stage.energy_after = number(j.at("energy_after"));
  stage.iou = number(j.at("iou"));
  stage.iterations = j.at("iterations");
  stage.seconds = j.value("seconds", 0.0);  // a batch leaves times out
  return stage;
}

nlohmann::json program_json() { return {{"name", "qjulia"}, {"version", version()}}; }

}  // namespace

nlohmann::json device_json(const DeviceInfo& device) {
  return {
      {"name", device.name}, {"platform", device.platform_name}, {"driver", device.driver_version}};
}

std::string up_line(UpAxis up, const std::optional<UpAxis>& chosen) {
  return fmt::format("up: {}{}", to_string(up),
                     chosen ? "" : ", a guess from the mesh; --up sets it");
}

nlohmann::json to_json(const FitOptions& options) {
  nlohmann::json json;
  base::add_json(json, fit_settings(), options);
  // Its name may say something else another day.
  json["schedule_fnv1a64"] = text_hash(schedule_text(options.schedule));
  if (options.initial) json["initial_fnv1a64"] = text_hash(to_json(*options.initial).dump());
  return json;
}

nlohmann::json final_figures(const FitResult& result) {
  nlohmann::json json = {
      {"energy", nullptr}, {"iou", nullptr}, {"mean_distance", result.mean_distance}};
  if (result.stages.empty()) return json;
  json["energy"] = result.stages.back().energy_after;
  json["iou"] = result.stages.back().iou;
  return json;
}

std::string program_name() { return std::string("qjulia ") + version(); }

nlohmann::json made_with(const Job& job) { return {{"job", to_json(job)}}; }

std::string one_line(const nlohmann::json& json) {
  std::string text = json.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
  // Comments of XML may not hold two hyphens in a row. Those of JSON stand in texts alone.
  for (std::size_t at = 0; (at = text.find("--", at)) != std::string::npos;) {
    text.replace(at + 1, 1, "\\u002d");
  }
  return text;
}

void write_picture(const Image& image, const std::filesystem::path& path, const nlohmann::json& how,
                   const std::string& map) {
  write_png(image, path, {{"Software", program_name()}, {"qjulia", one_line(how)}}, map);
}

void write_layered_picture(const LayeredImage& picture, const std::filesystem::path& path,
                           const nlohmann::json& how) {
  write_exr(picture, path, {{"software", program_name()}, {"qjulia", one_line(how)}});
}

nlohmann::json to_json(const PictureOptions& options) {
  nlohmann::json json;
  base::add_json(json, picture_settings(), options);
  if (options.material == Material::clay) {
    json["palette"] = nlohmann::json::array({color_name(options.palette.clay)});
  }
  return json;
}

nlohmann::json without_times(nlohmann::json provenance) {
  provenance.erase("seconds");
  if (provenance.contains("stages")) {
    for (nlohmann::json& stage : provenance["stages"]) stage.erase("seconds");
  }
  return provenance;
}

FitResult finished_fit(Map map, const std::filesystem::path& file) {
  FitResult result;
  try {
    const nlohmann::json made = map.provenance.json();
    for (const nlohmann::json& stage : made.at("stages"))
      result.stages.push_back(stage_from(stage));
    result.evaluations = made.at("evaluations");
    result.seconds = made.value("seconds", 0.0);
    result.mean_distance = number(made.at("metrics").value("mean_distance", nlohmann::json()));
    result.stopped = stop_reason(made.at("stopped"));
    result.warnings = made.at("warnings").get<std::vector<std::string>>();
  } catch (const nlohmann::json::exception&) {
    throw InputError(fmt::format("map '{}' does not say how it was fitted", file.string()));
  }
  result.map = std::move(map);
  return result;
}

Job fit_job(const std::filesystem::path& mesh_path, const FitOptions& options,
            const std::filesystem::path& initial) {
  Job job{.command = "fit", .options = {{"mesh", name_of(mesh_path)}}};
  job.inputs["mesh"].path = mesh_path;
  nlohmann::json usual, own;
  base::add_json(usual, fit_settings(), FitOptions{});
  base::add_json(own, fit_settings(), options);
  set_changes(job.options, usual, own);
  if (const std::filesystem::path schedule = options.schedule;
      base::extension_of(schedule) == ".toml") {
    job.options["schedule"] = name_of(schedule);
    job.inputs["schedule"].path = schedule;
  }
  if (!initial.empty()) {
    job.options["initial"] = name_of(initial);
    job.inputs["initial"].path = initial;
  }
  job.hash_inputs();
  return job;
}

FitOrigin origin_of(const FitOptions& options, Job job) {
  const std::string& hash = job.inputs["mesh"].hash;
  const nlohmann::json mesh = {{"name", job.options.at("mesh")},
                               {"fnv1a64", hash.empty() ? nlohmann::json() : nlohmann::json(hash)}};
  return {std::move(job), mesh, to_json(options), options.precision};
}

nlohmann::json provenance(const FitOrigin& origin, const Device& device, const FitResult& result) {
  nlohmann::json stages = nlohmann::json::array();
  for (const StageReport& stage : result.stages) stages.push_back(stage_json(stage));
  nlohmann::json used = device_json(device.info());
  if (!device.has_own_layout()) used["layout"] = to_string(device.layout());
  if (device.is_tuned(origin.precision)) used["tuning"] = to_json(device.tuning(origin.precision));
  Job job = origin.job;
  job.device = device_json(device.info());
  return {{"jobs", {to_json(job)}},
          {"program", program_json()},
          {"mesh", origin.mesh},
          {"options", origin.options},
          {"device", used},
          {"stages", stages},
          {"metrics", final_figures(result)},
          {"evaluations", result.evaluations},
          {"seconds", result.seconds},
          {"stopped", key(result.stopped)},
          {"warnings", result.warnings}};
}

}  // namespace qjulia::tools
