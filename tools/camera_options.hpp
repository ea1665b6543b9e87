#pragma once
/// Options of the commands that draw: how large, and from where.

#include <CLI/CLI.hpp>
#include <string>

#include "qjulia/picture.hpp"

namespace qjulia::tools {

/// --size.
void add_size(CLI::App& command, PictureOptions& options);

/// --azimuth, --elevation, --zoom, --field-of-view, --up.
void add_camera(CLI::App& command, Camera& camera, std::string& up);

}  // namespace qjulia::tools
