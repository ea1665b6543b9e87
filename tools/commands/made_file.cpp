#include "commands/made_file.hpp"

#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <utility>

#include "base/temporary_folder.hpp"
#include "describe/map_options.hpp"
#include "describe/provenance.hpp"
#include "qjulia/map/map_file.hpp"
#include "qjulia/mesh/mesh.hpp"

namespace qjulia::tools {
namespace {

bool is_picture(const explore::MakeRequest& wanted) { return wanted.extension == ".png"; }

/// What the command is to do, as far as the command can.
nlohmann::json options_of(const explore::MakeRequest& wanted, const CommandUsage& usage) {
  const explore::ViewRequest& view = wanted.view;
  nlohmann::json all = nlohmann::json::object();
  MapOptions turned;
  turned.knobs = view.knobs;
  set_changes(all, to_json(MapOptions{}), to_json(turned));
  set_changes(all, to_json(PictureOptions{}), to_json(view.picture));
  // Files of other types are turned by it, and pages show how the set stands in pictures.
  if (!is_picture(wanted) && !format_up("mesh" + wanted.extension)) all.erase("up");
  if (!is_picture(wanted)) all["resolution"] = wanted.resolution;
  if (wanted.millimetres) all["millimetres"] = *wanted.millimetres;
  // Clay has no colours, some files hold none, and those of an .obj are in another file.
  const bool has_colors = view.picture.material != Material::clay &&
                          (is_picture(wanted) ||
                           (holds_colors("mesh" + wanted.extension) && wanted.extension != ".obj"));
  if (!has_colors) all.erase("range");
  if (!has_colors && !is_picture(wanted)) {
    for (const char* name : {"material", "palette"}) all.erase(name);
  }
  nlohmann::json taken = nlohmann::json::object();
  for (const OptionUsage& option : usage.options) {
    const std::string name = job_name(option.name);
    if (option.is_in_job && all.contains(name)) taken[name] = all[name];
  }
  return taken;
}

std::string text_of(const nlohmann::json& report) {
  if (!report.contains("triangles")) {
    return fmt::format("{} x {} pixels", report.at("width").dump(), report.at("height").dump());
  }
  return fmt::format("{} triangles, {}", report.at("triangles").dump(),
                     report.at("closed").get<bool>() ? "closed and manifold" : "not closed");
}

}  // namespace

std::string made_file(const NamedMap& source, const Device& device, const Map& map,
                      const explore::MakeRequest& wanted, const ProgressMonitor& monitor) {
  const base::TemporaryFolder folder("qjulia");
  const auto input = folder.path() / "map.qjulia.json";
  const auto output = folder.path() / ("file" + wanted.extension);
  write_map(map, input);
  Job kept{.command = is_picture(wanted) ? "render" : "surface"};
  kept.options = options_of(wanted, command_usage(kept.command));
  Job job = kept;
  job.options["map"] = input.string();
  kept.options["map"] = source.name;
  kept.inputs["map"].hash = source.hash;
  const Said said = run_job(job, output.string(), {device, monitor}, kept);
  monitor.report({"", 1, 0, text_of(said.report)});
  std::ostringstream bytes;
  bytes << std::ifstream(output, std::ios::binary).rdbuf();
  return std::move(bytes).str();
}

}  // namespace qjulia::tools
