#pragma once
/// Files by their names, and what tells whether two are the same.

#include <filesystem>
#include <string>
#include <string_view>

namespace qjulia::tools {

/// Whether the name is that of a mesh: .obj, .off, .ply or .stl.
bool is_mesh_file(const std::filesystem::path& path);

/// @throws InputError when a map to be written has the name of another type, such as x.png.
void check_map_name(const std::filesystem::path& path);

/// Hexadecimal FNV-1a, 64 bits, of a file's bytes: tells whether two files are the same, and is no
/// protection against somebody who wants them to seem so.
/// http://www.isthe.com/chongo/tech/comp/fnv
/// @throws InputError when the file cannot be read.
std::string file_hash(const std::filesystem::path& path);

/// The same of a text.
std::string text_hash(std::string_view text);

}  // namespace qjulia::tools
