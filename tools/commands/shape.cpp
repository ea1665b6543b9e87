/// qjulia shape: a mesh in, a map out that holds the mesh's own distance.

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "base/file_types.hpp"
#include "base/setting_json.hpp"
#include "base/text.hpp"
#include "commands/commands.hpp"
#include "commands/roughness_report.hpp"
#include "describe/files.hpp"
#include "describe/provenance.hpp"
#include "describe/setting_option.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/edit/paint_settings.hpp"
#include "qjulia/edit/painting.hpp"
#include "qjulia/exact/exact_map.hpp"
#include "qjulia/exact/exact_settings.hpp"
#include "qjulia/map/map_file.hpp"
#include "qjulia/mesh/mesh.hpp"

namespace qjulia::tools {
namespace {

struct ShapeArguments {
  std::string mesh;
  OutputName output;
  TrustedDevice device;
  std::string versor = "random:60:1";
  ExactMapOptions options;
  PaintOptions paint;  ///< its thickness alone
  RoughnessTarget target;
};

/// What `--versor` says: "noise", "noise4" or "random" and numbers, or else a map file.
using Words = std::vector<std::string>;

bool is_noise(const Words& words) { return words[0] == "noise" || words[0] == "noise4"; }
bool is_random(const Words& words) { return words[0] == "random" && words.size() > 1; }

/// The noise that "noise[:OCTAVES[:SCALE[:SEED]]]" stands for, its scale in cells along the shape's
/// longest side.
NoiseVersor noise_of(const Words& words) {
  NoiseVersor noise;
  if (words[0] == "noise4") noise.values = NoiseValues::quaternions;
  const auto read = [&]<class Number>(std::size_t at, Number& value) {
    if (at >= words.size()) return true;
    const auto given = base::number_in<Number>(words[at]);
    value = given.value_or(value);
    return given.has_value();
  };
  double scale = kMapSide * noise.scale;
  const bool is_read =
      words.size() <= 4 && read(1, noise.octaves) && read(2, scale) && read(3, noise.seed);
  noise.scale = scale / kMapSide;
  const double least = kMapSide * NoiseVersor::kLeastScale;
  const double most = kMapSide * NoiseVersor::kMostScale;
  if (!is_read || noise.octaves < 1 || noise.octaves > NoiseVersor::kMostOctaves ||
      !(scale >= least && scale <= most)) {
    throw InputError(fmt::format(
        "--versor: give noise:OCTAVES:SCALE:SEED, such as noise:2:9:1, with 1 to {} octaves, a "
        "scale of {} to {} and a whole number as the seed",
        NoiseVersor::kMostOctaves, least, most));
  }
  return noise;
}

/// Sets the versor that `--versor` asks for, and the phase of the map it is of.
void choose_versor(const std::string& versor, ExactMapOptions& options) {
  const Words words = base::split(versor, ':');
  if (is_noise(words)) {
    options.versor = noise_of(words);
  } else if (is_random(words)) {
    const auto roots = base::number_in<int>(words[1]);
    const auto seed = base::number_in<std::uint64_t>(words.size() > 2 ? words[2] : "1");
    if (!roots || !seed || words.size() > 3) {
      throw InputError(fmt::format(
          "--versor: '{}' is not random:K:SEED with two whole numbers, such as random:60:1",
          versor));
    }
    if (*roots < 1 || *roots > RandomRoots::kMostRoots) {
      throw InputError(fmt::format("--versor: '{}' has {} roots; give 1 to {}", versor, *roots,
                                   RandomRoots::kMostRoots));
    }
    options.versor = RandomRoots{*roots, *seed};
  } else {
    const Map map = read_map(versor);
    if (!std::holds_alternative<FactorsVersor>(map.dynamics.versor)) {
      throw InputError(
          fmt::format("--versor: '{}' is a {} map; give one whose versor is of factors", versor,
                      map.dynamics.kind()));
    }
    options.versor = FactorsOfMap{map.dynamics.factors, map.frame.shape_to_map};
    options.phase = map.dynamics.phase;
  }
}

nlohmann::json options_json(const ShapeArguments& arguments) {
  nlohmann::json json = {{"versor", arguments.versor}};
  base::add_json(json, exact_settings(), arguments.options);
  if (arguments.paint.thickness) json["thickness"] = *arguments.paint.thickness;
  return json;
}

/// The versor may be that of a map, which is read once the outputs are checked.
Plan plan_shape(const ShapeArguments& arguments) {
  std::vector<std::filesystem::path> inputs{arguments.mesh};
  if (const Words words = base::split(arguments.versor, ':');
      !is_noise(words) && !is_random(words)) {
    inputs.emplace_back(arguments.versor);
  }
  check_map_name(arguments.output.path);
  arguments.options.validate();
  arguments.paint.validate();
  arguments.target.validate();
  return {std::move(inputs), {output_named("--output", arguments.output)}};
}

int run_shape(const ShapeArguments& arguments, const Plan& /*plan*/, Session& session) {
  ExactMapOptions options = arguments.options;
  choose_versor(arguments.versor, options);
  options.validate();
  const TriangleMesh mesh = session.read_mesh(arguments.mesh);
  const Device device = session.open_device(arguments.device);
  Map map = exact_map(device, mesh, options, session.monitor());
  if (arguments.paint.thickness) {
    map.layers.paint = painted(device, map, arguments.paint, session.monitor());
  }
  const ReachedRoughness reached = reach_target(device, map, arguments.target, &mesh, session);
  map.provenance.set("shape", options_json(arguments));
  add_job(map, session.job());
  write_map(map, arguments.output.path);
  session.report_kernels(device);
  const auto& distance = std::get<DistanceModulus>(map.dynamics.modulus);
  if (distance.inradius < distance.step) {
    session.console.warn(
        "the shape's inside is thinner than two cells, so that parts of it may be missing; give a "
        "higher --resolution");
  }
  const auto [nx, ny, nz] = distance.grid->data().cells;
  session.console.summary(
      fmt::format("{} x {} x {} cells, {}, {:.1f} s\n{}{}\nmap: {}\nnext: qjulia render {} -o "
                  "picture.png",
                  nx, ny, nz,
                  map.dynamics.factors.empty()
                      ? "noise"
                      : fmt::format("{} factors", map.dynamics.factors.size()),
                  session.seconds(), reached.text, up_line(*map.frame.up, arguments.options.up),
                  arguments.output.path, shell_word(arguments.output.path)),
      {{"map", arguments.output.path},
       {"cells", {nx, ny, nz}},
       {"factors", map.dynamics.factors.size()},
       {"up", to_string(*map.frame.up)},
       {"target", reached.json},
       {"seconds", session.seconds()}});
  return kDone;
}

void describe_shape(Command command, ShapeArguments& a) {
  command
      .input("MESH", a.mesh,
             "Triangle mesh, or points with normals: " +
                 base::extension_list(base::FileContent::mesh, base::FileUse::read))
      .offers_files(readable({base::FileContent::mesh}));
  command
      .output(
          "-o,--output", a.output, [&a] { return named_after(a.mesh, ".qjulia.json"); }, "MAP",
          "Map file to write, such as bunny.qjulia.json." + named_text("mesh", ".qjulia.json"))
      .offers_files({".json"});
  add_settings(command, exact_settings(), a.options);
  const auto& thickness = setting_named(paint_settings(), "thickness", "paints");
  const std::string painted =
      "Paints the map: bounds the shell by this share of the shape's own thickness, 0.01 to 2, so "
      "that thin limbs keep their shape under a larger --detail. 0.15 is a good value";
  add_setting(command, with_help(thickness, painted), thickness.place(a.paint));
  command
      .add("--versor", &a.versor, "random:K:SEED|noise:N:SCALE:SEED|MAP",
           "What gives the grooves their pattern: random:K:SEED for K roots placed at random in "
           "the shape; noise:OCTAVES:SCALE:SEED for gradient noise, SCALE its cells along the "
           "shape's longest side (noise4 the same in all four components); or a map file whose "
           "factors are taken")
      .offers({"random:60:1", "noise:2:9:1", "noise4:2:9:1"})
      .offers_files(readable({base::FileContent::map}));
  add_settings(command, target_settings(), a.target);
  add_device_to_use(command, a.device);
}

}  // namespace

void add_shape(CommandLine& program, ChosenCommand& chosen) {
  add_command(program, chosen,
              {"shape", "Make a map that has a mesh's exact shape, without a fit", R"(Examples:
  qjulia shape human.obj -o human.qjulia.json
  qjulia shape human.obj -o other.qjulia.json --versor random:60:2
  qjulia shape human.obj -o noise.qjulia.json --versor noise:2:9:1
  qjulia shape bunny.obj -o bunny.qjulia.json --versor fitted.qjulia.json
  qjulia shape bunny.obj -o twice.qjulia.json --target-area 2 --target-volume 1
The map holds the mesh's distance on a grid: about a megabyte, where a fitted map has
about a hundred kilobytes, but thin limbs and sharp edges are all there. The versor, which gives
the grooves their pattern, is free. See docs/theory/exact-maps.md.)"},
              describe_shape, plan_shape, run_shape);
}

}  // namespace qjulia::tools
