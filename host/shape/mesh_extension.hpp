#pragma once

#include <filesystem>
#include <string>

namespace qjulia {

/// .obj, .off, .ply or .stl in lower case. @param verb what is to be done with the file.
/// @throws InputError naming the file, for any other extension.
std::string mesh_extension(const std::filesystem::path& path, const char* verb);

}  // namespace qjulia
