#pragma once
/// Options of the commands that draw: how large, from where, in what colours and before what.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "describe/command_line.hpp"
#include "qjulia/picture/picture.hpp"

namespace qjulia::tools {

/// The option of one of the settings of pictures.
Option add_picture_setting(Command command, std::string_view name, PictureOptions& options);

/// --azimuth, --elevation, --zoom, --look-at, --distance, --frame, --field-of-view, --aperture,
/// --focus, --up.
std::vector<Option> add_camera(Command command, PictureOptions& options);

/// --look. It comes before all options that are in looks, so that these hold where they are given,
/// too.
Option add_look_name(Command command, PictureOptions& options);

/// --palette, for materials of several colours or of one.
Option add_palette(Command command, std::optional<std::string>& palette,
                   const std::string& description);

/// As `palette_from`, with commas between colours.
Palette palette_of(const std::string& text, Material material);

/// The settings of light and matter, --keep-loose and --palette. Both objects must outlive the
/// options and must not be moved.
void add_look(Command command, std::optional<std::string>& palette, PictureOptions& options);

}  // namespace qjulia::tools
