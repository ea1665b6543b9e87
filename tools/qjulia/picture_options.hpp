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

/// --azimuth, --elevation, --zoom, --look-at, --distance, --frame, --field-of-view, --up.
std::vector<Option> add_camera(Command command, PictureOptions& options);

/// --material.
Option add_material(Command command, PictureOptions& options);

/// --range and --range-between.
std::vector<Option> add_range(Command command, std::optional<MaterialRange>& range);

/// --palette, for materials of several colours or of one.
Option add_palette(Command command, std::string& palette, const std::string& description);

/// A palette by name, or of the colours given: one for clay, several for other materials.
/// @throws InputError naming the option.
Palette palette_of(const std::string& text, Material material);

struct LookOptions {
  std::string background = "studio";
  std::string palette = "earth";
  bool no_ground = false;
};

/// --background, --no-ground, --palette, --keep-loose, --lamp, --range and --range-between. Both
/// objects must outlive the option and must not be moved.
void add_look(Command command, LookOptions& look, PictureOptions& options);

/// The picture's options with the look that was given; their material is set before.
/// @throws InputError naming the option.
PictureOptions with_look(PictureOptions options, const LookOptions& look);

}  // namespace qjulia::tools
