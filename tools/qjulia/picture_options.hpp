#pragma once
/// Options of the commands that draw: how large, from where, in what colours and before what.

#include <optional>
#include <string>
#include <vector>

#include "command_line.hpp"
#include "qjulia/picture.hpp"

namespace qjulia::tools {

/// --size.
Option add_size(Command command, PictureOptions& options);

/// --azimuth, --elevation, --zoom, --look-at, --distance, --frame, --field-of-view, --aperture,
/// --focus, --up.
std::vector<Option> add_camera(Command command, PictureOptions& options);

/// --look. It comes before all options that are in looks, so that these hold where they are given,
/// too.
Option add_look_name(Command command, PictureOptions& options);

/// --material.
Option add_material(Command command, PictureOptions& options);

/// --range and --range-between.
std::vector<Option> add_range(Command command, std::optional<MaterialRange>& range);

/// --palette, for materials of several colours or of one.
Option add_palette(Command command, std::optional<std::string>& palette,
                   const std::string& description);

/// As `palette_from`, with commas between colours.
Palette palette_of(const std::string& text, Material material);

struct LookOptions {
  std::optional<std::string> palette;
  bool no_ground = false;
};

/// The settings of light and matter, --no-ground, --palette, --keep-loose, --range and
/// --range-between. Both
/// objects must outlive the option and must not be moved.
void add_look(Command command, LookOptions& look, PictureOptions& options);

/// The picture's options with the look that was given; their material is set before.
/// @throws InputError naming the option.
PictureOptions with_look(PictureOptions options, const LookOptions& look);

}  // namespace qjulia::tools
