/// qjulia compare: how well a map fits a mesh.

#include "qjulia/surface/compare.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/file_types.hpp"
#include "commands/commands.hpp"
#include "commands/roughness_report.hpp"
#include "describe/files.hpp"
#include "describe/map_options.hpp"
#include "describe/picture_options.hpp"
#include "describe/provenance.hpp"
#include "describe/setting_option.hpp"
#include "qjulia/picture/picture.hpp"
#include "qjulia/surface/compare_settings.hpp"

namespace qjulia::tools {
namespace {

struct CompareArguments {
  std::string map, mesh;
  std::string picture;  ///< empty: none
  PictureOptions view;
  TrustedDevice device;
  MapOptions map_options;
  CompareOptions options;
  bool roughness = false;
};

/// The value in so many columns, with so many digits after the point; "-" if it is undefined.
std::string figure(double value, int columns, int digits) {
  return std::isnan(value) ? fmt::format("{:>{}}", "-", columns)
                           : fmt::format("{:{}.{}f}", value, columns, digits);
}

std::string table(const std::vector<FitMetrics>& metrics) {
  std::string text =
      "  n     IoU   mean distance   95 % within   Hausdorff   roughness   energy\n"
      "               % of diagonal    % of diag.  % of diag.  area ratio";
  for (const FitMetrics& m : metrics) {
    text += fmt::format(
        "\n{:3}  {}  {}  {}  {}  {}  {}", m.iterations, figure(m.iou, 6, 4),
        figure(100 * m.mean_distance, 14, 3), figure(100 * m.distance_95, 12, 3),
        figure(100 * m.hausdorff_distance, 10, 2), figure(m.roughness, 10, 3),
        std::isnan(m.energy) ? figure(m.energy, 7, 4) : fmt::format("{:+.4f}", m.energy));
  }
  for (const FitMetrics& m : metrics) {
    const std::string why = why_undefined(m);
    if (!why.empty()) text += fmt::format("\nundefined at n = {}: {}", m.iterations, why);
  }
  if (metrics.back().limbs >= 0) {
    for (const FitMetrics& m : metrics) {
      text += fmt::format("\nlimbs at n = {}: {} of {}", m.iterations, m.limbs_kept, m.limbs);
    }
  }
  return text + fmt::format("\nslope varies by {} of its mean over the surface (0: an even shell)",
                            figure(metrics.front().slope_variation, 0, 3));
}

/// The picture of a comparison, which shows the part of space and the orbits that are compared.
PictureOptions view_of(const CompareArguments& arguments) {
  const CompareOptions& compared = arguments.options;
  PictureOptions view = arguments.view;
  view.iterations = compared.iterations;
  view.box = compared.box;
  view.escape = compared.escape;
  view.precision = compared.precision;
  return view;
}

Plan plan_compare(const CompareArguments& arguments) {
  arguments.map_options.knobs.validate();
  arguments.options.validate();
  view_of(arguments).validate();
  Plan plan{{arguments.map, arguments.mesh}, {}};
  if (!arguments.picture.empty()) {
    plan.outputs.push_back({"--picture", arguments.picture, {".png"}});
  }
  return plan;
}

int run_compare(const CompareArguments& arguments, const Plan& /*plan*/, Session& session) {
  const CompareOptions& options = arguments.options;
  const PictureOptions view = view_of(arguments);
  const Map read = session.read_map(arguments.map);
  const TriangleMesh mesh = session.read_mesh(arguments.mesh);
  const Device device = session.open_device(arguments.device);
  const Map map = with_knobs(device, read, arguments.map_options, arguments.map);
  const nlohmann::json how = made_with(session.job());
  if (!arguments.picture.empty()) {
    const Image image = comparison(device, map, mesh, view, session.monitor());
    if (image.covered == 0) {
      session.console.warn("the picture shows nothing of the set; try another --box or camera");
    }
    nlohmann::json picture = how;
    picture["picture"] = to_json(view);
    write_picture(image, arguments.picture, picture);
    session.written_so_far = fmt::format("'{}' was written", arguments.picture);
  }
  const auto metrics = compare(device, map, mesh, options, session.monitor());
  std::optional<Roughness> rough;
  nlohmann::json of_mesh, porous;
  std::string roughness_lines;
  if (arguments.roughness) {
    rough = roughness(device, map, {options.resolution, options.iterations}, session.monitor());
    roughness_lines = "\n" + roughness_text(*rough);
    try {
      const MeshScales scales = mesh_scales(device, mesh, options.resolution, session.monitor());
      const Porosity found =
          porosity(device, mesh, std::min(options.resolution, 128), session.stop());
      roughness_lines += fmt::format("\nthe mesh, seen with the same cells:\n{}\n{}",
                                     scales_text(scales), porosity_text(found));
      of_mesh = to_json(scales), porous = to_json(found);
    } catch (const InputError& error) {
      session.console.warn(
          fmt::format("the roughness of '{}' is not measured: {}", arguments.mesh, error.what()));
    }
  }
  session.report_kernels(device);
  nlohmann::json list = nlohmann::json::array();
  for (const FitMetrics& m : metrics) list.push_back(to_json(m));
  session.console.result(
      table(metrics) + roughness_lines,
      {{"map", arguments.map},
       {"mesh", arguments.mesh},
       {"resolution", options.resolution},
       {"picture",
        arguments.picture.empty() ? nlohmann::json() : nlohmann::json(arguments.picture)},
       {"made_with", how},
       {"metrics", list},
       {"roughness", rough ? to_json(*rough) : nlohmann::json()},
       {"area_at_scales", of_mesh},
       {"porosity", porous},
       {"seconds", session.seconds()}});
  return kDone;
}

void describe_compare(Command command, CompareArguments& a) {
  a.view.width = 640;
  a.view.height = 480;
  command.input("MAP", a.map, "Map file of 'qjulia fit' or 'qjulia shape'")
      .offers_files(readable({base::FileContent::map}));
  command
      .input("MESH", a.mesh,
             "The mesh it was fitted to: " +
                 base::extension_list(base::FileContent::mesh, base::FileUse::read))
      .offers_files(readable({base::FileContent::mesh}));
  for (const char* name : {"resolution", "limbs"}) {
    const auto& setting = setting_named(compare_settings(), name, "comparisons");
    add_setting(command, setting, setting.place(a.options));
  }
  command.flag(
      "--measure-roughness", a.roughness,
      "Also measure how rough the set and the mesh are, each by itself: area and volume over the "
      "smooth set's, or the mesh's own, at --resolution cells, a half, a quarter and an eighth of "
      "it, box dimension and porosity");
  const Option picture =
      command
          .file("--picture", a.picture, "FILE.png",
                "Also draw mesh, potential, set and the distance of set from mesh as colour: .png "
                "of four pictures with a scale")
          .names_output()
          .offers_files({".png"});
  add_picture_setting(command, "size", a.view).needs(picture);
  for (const Option& option : add_camera(command, a.view)) option.needs(picture);
  add_map_options(command, a.map_options, compare_settings(), "comparisons", a.options);
  add_device_to_use(command, a.device);
}

}  // namespace

void add_compare(CommandLine& program, ChosenCommand& chosen) {
  add_command(program, chosen,
              {"compare", "Measure how well a map fits a mesh", std::string(R"(Example:
  qjulia compare bunny.qjulia.json bunny.obj
  qjulia compare bunny.qjulia.json bunny.obj --picture bunny.png --azimuth 120
IoU is volume in common over volume in either: 1 is a perfect fit. It is taken over a cube
centred on the mesh's box, side 1.15 times its longest side. Distances are between the two
surfaces. Roughness is the set's area over the mesh's: detail makes it grow. Energy is that
of Kim 2015 over the cube's cells, with cells near the mesh weighing more and the inside as
much as the outside: -1 if all are clearly on the right side, +1 if all are clearly on the
wrong one. It is not the energy that 'qjulia fit' minimises. The first line is for n = 1, the
second for --iterations.
)") + kMapOptionsHelp},
              describe_compare, plan_compare, run_compare);
}

}  // namespace qjulia::tools
