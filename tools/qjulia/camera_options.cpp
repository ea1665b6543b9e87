#include "camera_options.hpp"

#include <fmt/format.h>

#include "options.hpp"
#include "qjulia/error.hpp"

namespace qjulia::tools {

void add_size(Command command, PictureOptions& options) {
  command
      .word(
          "--size",
          [&options](const std::string& text) {
            const auto [width, height] = parse_size(text);
            options.width = width;
            options.height = height;
          },
          "Width and height in pixels")
      .type("WxH")
      .default_text(fmt::format("{}x{}", options.width, options.height));
}

void add_camera(Command command, Camera& camera) {
  command.add("--azimuth", &camera.azimuth, "Degrees the camera is turned about the up axis");
  command.add("--elevation", &camera.elevation, "Degrees of the camera above the horizon");
  command.add("--zoom", &camera.zoom, "1 frames the whole shape, 2 half of it");
  command
      .numbers(
          "--look-at", 3,
          [&camera](const std::vector<double>& p) {
            camera.look_at = Eigen::Vector3d(p[0], p[1], p[2]);
          },
          "The point in the middle of the picture, shape units. Default: the middle of what is "
          "framed")
      .type("X Y Z");
  command
      .numbers(
          "--frame", 6,
          [&camera](const std::vector<double>& b) {
            camera.frame = Box{{b[0], b[1], b[2]}, {b[3], b[4], b[5]}};
            if (!(camera.frame->size().array() > 0).all()) {
              throw InputError("give X0 Y0 Z0 X1 Y1 Z1 with X0 < X1, Y0 < Y1 and Z0 < Z1");
            }
          },
          "What fills the picture at zoom 1, shape units, seen from as far as the whole shape "
          "would be. Default: the whole shape")
      .type("X0 Y0 Z0 X1 Y1 Z1");
  command.add("--field-of-view", &camera.field_of_view, "Degrees, vertical");
  add_up(command, camera.up,
         "The shape's axis that points up; auto is what the map says, or y where it says nothing. "
         "Of a mesh it is a guess: its flattest, widest end is down");
}

}  // namespace qjulia::tools
