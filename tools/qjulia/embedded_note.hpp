#pragma once
/// What files written by this program say of how they were made.

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <stop_token>

namespace qjulia::tools {

/// Reads the note that `render`, `compare` and `surface` leave in pictures (.png, a tEXt chunk) and
/// scenes (.glb, asset.extras.made_with).
/// @return the note under "made_with", and "width" and "height" of a picture or "vertices" and
/// "triangles" of a scene.
/// @throws InputError when the file is neither, or says nothing.
nlohmann::json read_embedded_note(const std::filesystem::path& path, const std::stop_token& stop);

/// Whether the name is that of such a file.
bool can_hold_note(const std::filesystem::path& path);

}  // namespace qjulia::tools
