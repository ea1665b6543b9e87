#include "camera_options.hpp"

#include <fmt/format.h>

#include "options.hpp"

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
  command.add("--field-of-view", &camera.field_of_view, "Degrees, vertical");
  command.choice("--up", camera.up, {{"x", 'x'}, {"y", 'y'}, {"z", 'z'}},
                 "The shape's axis that points up");
}

}  // namespace qjulia::tools
