#pragma once
/// What the note in a picture that `render` made says to those who want it again.

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace qjulia::tools {

/// The words of the command that draws a picture again, bit for bit on the same device.
/// @param made the note, as `embedded_note` gives it. @param picture its file. @param holds_map
/// whether it holds the map, with its knobs turned; else the command names the file that the map
/// was read from, and its knobs.
/// Empty where the note is not that of a single picture.
std::string render_command(const nlohmann::json& made, const std::string& picture, bool holds_map);

/// What follows '#' in the address of a page of `explore` that shows the picture's view: the
/// controls of the page that differ from their defaults. Empty where the note says nothing of it.
std::string page_state(const nlohmann::json& made);

}  // namespace qjulia::tools
