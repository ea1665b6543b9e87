#include "camera_options.hpp"

#include <fmt/format.h>

#include "options.hpp"

namespace qjulia::tools {

void add_size(CLI::App& command, PictureOptions& options) {
  command
      .add_option_function<std::string>(
          "--size",
          [&options](const std::string& text) {
            const auto [width, height] = parse_size(text);
            options.width = width;
            options.height = height;
          },
          "Width and height in pixels")
      ->type_name("WxH")
      ->default_str(fmt::format("{}x{}", options.width, options.height));
}

void add_camera(CLI::App& command, Camera& camera, std::string& up) {
  add_number(command, "--azimuth", camera.azimuth, "Degrees the camera is turned about the up axis")
      ->capture_default_str();
  add_number(command, "--elevation", camera.elevation, "Degrees of the camera above the horizon")
      ->capture_default_str();
  add_number(command, "--zoom", camera.zoom, "1 frames the whole shape, 2 half of it")
      ->capture_default_str();
  add_number(command, "--field-of-view", camera.field_of_view, "Degrees, vertical")
      ->capture_default_str();
  command.add_option("--up", up, "The shape's axis that points up")
      ->check(CLI::IsMember({"x", "y", "z"}))
      ->capture_default_str();
}

}  // namespace qjulia::tools
