#include "describe/view_options.hpp"

#include <nlohmann/json.hpp>

#include "describe/files.hpp"
#include "describe/picture_options.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/picture/picture_settings.hpp"

namespace qjulia::tools {

nlohmann::json to_json(const ScatterView& scatter) {
  nlohmann::json json = to_json(static_cast<const Scatter&>(scatter));
  json["scatter_time"] = scatter.time;
  json["scatter_resolution"] = scatter.resolution;
  return json;
}

void add_view(Command command, ViewArguments& arguments) {
  PictureOptions& picture = arguments.view.picture;
  add_picture_setting(command, "size", picture);
  add_picture_setting(command, "samples", picture);
  add_picture_setting(command, "bits", picture);
  arguments.camera = add_camera(command, picture);
  add_picture_setting(command, "cut", picture);
  add_look_name(command, picture);
  arguments.material = add_picture_setting(command, "material", picture);
  add_picture_setting(command, "exact", picture);
  add_look(command, arguments.palette, picture);
  add_map_options(command, arguments.view.map_options, picture_settings(), "pictures", picture);
  ScatterView& scatter = arguments.view.scatter;
  const Option field =
      add_scatter(command, scatter,
                  "Draw the set as a mesh of clay whose connected parts but the largest fly: away "
                  "from the middle, with a wind, or to the floor. Loose pieces are then kept. A "
                  "large --drift or --detail makes many");
  command
      .add("--scatter-time", &scatter.time, "SECONDS",
           "When the parts are shown, in seconds since they set off")
      .range(0, 600)
      .needs(field);
  command
      .add("--scatter-resolution", &scatter.resolution, "CELLS",
           "Cells along the longest side of the mesh whose parts fly")
      .range(16, 2048)
      .needs(field);
}

View checked_view(const ViewArguments& arguments, const std::string& input) {
  View view = arguments.view;
  PictureOptions& picture = view.picture;
  picture.validate();
  view.map_options.knobs.validate();
  if (arguments.palette) picture.palette = palette_of(*arguments.palette, picture.material);
  auto given = view.map_options.given();
  if (!picture.cuts.empty()) given.emplace_back("--cut");
  if (!given.empty()) expect_map(given.front(), input);
  if (is_mesh_file(input) && !arguments.material->given()) {
    picture.material = Material::clay;  // a look's is for maps
  }
  if (picture.material != Material::clay) expect_map("--material", input);
  if (picture.range && picture.material == Material::clay) {
    throw InputError("--range: clay has one colour; give --material iterations or another, too");
  }
  if (picture.keep_loose) expect_map("--keep-loose", input);
  if (picture.exact) expect_map("--exact", input);
  if (view.scatter.field) {
    view.scatter.options.validate();
    expect_map("--scatter", input);
    if (!arguments.material->given()) picture.material = Material::clay;
    if (picture.material != Material::clay || !picture.cuts.empty() || picture.exact) {
      throw InputError("--scatter draws a mesh of clay: leave --material, --cut and --exact out");
    }
  }
  return view;
}

}  // namespace qjulia::tools
