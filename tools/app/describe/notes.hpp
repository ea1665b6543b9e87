#pragma once
/// What files say of how they were made.

#include <filesystem>
#include <nlohmann/json.hpp>
#include <stop_token>

namespace qjulia::tools {

/// The note that commands leave in what they write: in a .png a tEXt chunk, in a .glb
/// asset.extras.made_with, in other files comments or metadata.
/// @return the note under "made_with", and "width" and "height" of a picture or "vertices" and
/// "triangles" of a .glb.
/// @throws InputError when the file says nothing.
nlohmann::json embedded_note(const std::filesystem::path& path, const std::stop_token& stop);

}  // namespace qjulia::tools
