#pragma once
/// Options of the commands that draw: how large, and from where.

#include "command_line.hpp"
#include "qjulia/picture.hpp"

namespace qjulia::tools {

/// --size.
void add_size(Command command, PictureOptions& options);

/// --azimuth, --elevation, --zoom, --look-at, --frame, --field-of-view, --up.
void add_camera(Command command, Camera& camera);

}  // namespace qjulia::tools
