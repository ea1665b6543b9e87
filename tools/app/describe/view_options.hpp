#pragma once
/// What a picture of a map or a mesh depends on, as options give it.

#include <optional>
#include <string>
#include <vector>

#include "describe/command_line.hpp"
#include "describe/map_options.hpp"
#include "describe/scatter_options.hpp"
#include "qjulia/picture/picture.hpp"

namespace qjulia::tools {

/// The set's connected parts on their way, drawn as a mesh.
struct ScatterView : Scatter {
  double time = 0;       ///< seconds since the flight began, 0 or more
  int resolution = 256;  ///< cells of the mesh along its longest side
};

/// By the options' names.
nlohmann::json to_json(const ScatterView& scatter);

struct View {
  MapOptions map_options;
  PictureOptions picture;
  ScatterView scatter{};
  std::string map{};  ///< file of the map, where the views of a series have several; empty: they
                      ///< have one
};

/// The options of a view.
struct ViewArguments {
  View view;
  std::optional<std::string> palette;  ///< it is read once the material is known
  std::vector<Option> camera;
  std::optional<Option> material;
};

/// --size, --samples, --bits, those of the camera, --cut, --look, --material, --exact, those of
/// looks, those of maps and those of parts that fly. `arguments` must stay where it is.
void add_view(Command command, ViewArguments& arguments);

/// The view, checked. @param input the map or mesh that it shows. @throws InputError naming the
/// option
View checked_view(const ViewArguments& arguments, const std::string& input);

}  // namespace qjulia::tools
