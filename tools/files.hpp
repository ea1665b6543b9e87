#pragma once
/// What commands ask of file names before they start long work.

#include <filesystem>
#include <initializer_list>
#include <string>
#include <string_view>

namespace qjulia::tools {

/// Tries whether `path` can be written, and leaves no trace.
/// @throws OutputError, also where a folder stands in its place.
void require_writable(const std::filesystem::path& path);

/// @throws InputError unless `path` ends in one of `extensions`, in any case.
void require_extension(const std::filesystem::path& path,
                       std::initializer_list<const char*> extensions);

/// Whether the name is that of a mesh: .obj, .off, .ply or .stl.
bool is_mesh_file(const std::filesystem::path& path);

/// Whether the name is that of an original program's map: .o3d.
bool is_original_file(const std::filesystem::path& path);

/// Hexadecimal FNV-1a, 64 bits, of a file's bytes: tells whether two files are the same, and is no
/// protection against somebody who wants them to seem so.
/// http://www.isthe.com/chongo/tech/comp/fnv
/// @throws InputError when the file cannot be read.
std::string file_hash(const std::filesystem::path& path);

/// The same of a text.
std::string text_hash(std::string_view text);

}  // namespace qjulia::tools
