/// qjulia film scene: a script in, its camera and lamps out, for other programs.

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <vector>

#include "commands/film_commands.hpp"
#include "commands/film_script.hpp"
#include "describe/files.hpp"
#include "describe/provenance.hpp"
#include "film/scene_file.hpp"
#include "jobs/picture_series.hpp"

namespace qjulia::tools {
namespace {

struct SceneArguments {
  std::string script;
  OutputName output;
  TrustedDevice device;
  double seconds = 0;
};

ScriptPlan plan_scene(const SceneArguments& arguments) {
  return script_plan(arguments.script, arguments.seconds,
                     output_named("--output", arguments.output, {".glb", ".usda"}));
}

int run_scene(const SceneArguments& arguments, const ScriptPlan& plan, Session& session) {
  const Device device = session.open_device(arguments.device);
  const FilmScript script = with_maps(plan.script, device, session);
  const View base = script.base();
  std::vector<View> views = script.views(base);
  views.resize(script.pictures());
  Scene shown = read_scene(script.input, session);
  film::FilmScene scene;
  scene.up = base.picture.camera.up.value_or(shown.map ? shown.map->frame.up.value_or(kDefaultUp)
                                                       : guess_up(shown.mesh));
  scene.rate = script.rate;
  scene.aspect = static_cast<double>(base.picture.width) / base.picture.height;
  PictureSeries series(device, std::move(shown), script.input, views, session.job(), session);
  const SeriesFrame frame = series.frame();
  for (std::size_t i = 0; i < views.size(); ++i) {
    Camera camera = frame.cameras[i];
    camera.up = scene.up;
    scene.cameras.push_back(pose_of(camera, base.picture.width, base.picture.height));
    scene.lamps.push_back(lamp_poses(views[i].picture.light, camera));
  }
  if (base::extension_of(arguments.output.path) == ".glb" && !film::fits_glb(scene)) {
    session.console.warn(
        "the field of view changes, as 'zoom' does, and a camera in a .glb keeps its first one; "
        "write .usda, or move 'distance' in place of 'zoom'");
  }
  film::write_scene(scene, arguments.output.path, one_line(made_with(session.job())));
  session.report_kernels(device);
  session.console.summary(
      fmt::format("{} pictures, a camera and {} lamps, {:.1f} s\nscene: {}", views.size(),
                  scene.lamps.front().size(), session.seconds(), arguments.output.path),
      {{"scene", arguments.output.path},
       {"pictures", views.size()},
       {"lamps", scene.lamps.front().size()},
       {"seconds", session.seconds()}});
  return kDone;
}

void describe_scene(Command command, SceneArguments& a) {
  add_script(command, a.script);
  command
      .output(
          "-o,--output", a.output, [&a] { return named_after(a.script, ".usda"); }, "SCENE",
          "Scene to write: .glb or .usda." + named_text("script", ".usda"))
      .offers_files({".glb", ".usda"});
  add_seconds(command, a.seconds);
  add_device_to_use(command, a.device);
}

}  // namespace

void add_film_scene(CommandLine& program, ChosenCommand& chosen) {
  add_command(program, chosen,
              {"film scene", "Write a film's camera and lamps for other programs", R"(Examples:
  qjulia film scene dive.toml -o camera.usda
  qjulia surface bunny.qjulia.json -o bunny.usda      the mesh that it films, in the same place
The camera moves by an animation (.glb) or by time samples (.usda); lamps are parallel lights. Where
zoom is keyed, .usda alone has it.)",
               /*can_trace=*/true},
              describe_scene, plan_scene, run_scene);
}

}  // namespace qjulia::tools
