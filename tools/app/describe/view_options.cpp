#include "describe/view_options.hpp"

#include "describe/files.hpp"
#include "describe/picture_options.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/picture/picture_settings.hpp"

namespace qjulia::tools {

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
  return view;
}

}  // namespace qjulia::tools
