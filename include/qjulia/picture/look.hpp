#pragma once
/// Looks: settings of pictures that go together, such as those of gold in a museum's light. A look
/// is a file that users write, too:
///
///     description = "Green wax in the light of two lamps"
///     material = "clay"
///     palette = "5fa86f"
///     wax = 0.8
///     light = "rim"
///     lamp = ["140,30,4,5000K,6", "-30,30,0.2"]

#include <string>
#include <string_view>
#include <vector>

#include "qjulia/picture/picture.hpp"

namespace qjulia {

/// The names of the built-in looks, sorted.
std::vector<std::string> look_names();
/// What a built-in look says of itself. @throws InputError where there is none of this name.
std::string look_description(std::string_view name);

/// Sets what a look says, and leaves the rest. The settings of `picture_settings` that are of looks
/// may stand in it, and `ground`.
/// @param look a built-in one's name, or the path of a file that ends in .toml. @throws InputError
/// naming the file and the line, or listing the names.
void apply_look(PictureOptions& options, const std::string& look);

/// The same for a built-in look alone, where no file is to be read.
void apply_built_in_look(PictureOptions& options, std::string_view name);

}  // namespace qjulia
