#pragma once
/// Options of what a picture looks like: its colours, and what is behind and under the set.

#include <string>
#include <vector>

#include "command_line.hpp"
#include "qjulia/picture.hpp"

namespace qjulia::tools {

struct LookOptions {
  std::string background = "studio";
  std::string palette = "earth";
  bool no_ground = false;
  bool keep_loose = false;
  Lamp lamp{};
};

/// --background, --no-ground, --palette, --keep-loose and --lamp. `look` must stay where it is.
void add_look(Command command, LookOptions& look);

/// The picture's options with what was given; their material is set before.
/// @throws InputError naming the option.
PictureOptions with_look(PictureOptions options, const LookOptions& look);

}  // namespace qjulia::tools
