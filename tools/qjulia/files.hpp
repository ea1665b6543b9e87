#pragma once
/// What commands ask of files before they start long work.

#include <filesystem>
#include <memory>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "base/output_check.hpp"

namespace qjulia::tools {

/// Checks all that a command reads and writes, before any work: `check_distinct` and
/// `check_writable` of base/output_check.hpp. @throws InputError, OutputError
void check_outputs(const std::vector<std::filesystem::path>& inputs,
                   const std::vector<base::Output>& outputs);

/// Whether it is a pipe that others can open by its name.
bool is_named_pipe(const std::filesystem::path& path);

/// Waits until somebody reads the pipe. @return its descriptor, which closes itself.
/// @throws OutputError, Interrupted
std::shared_ptr<const int> opened_when_read(const std::filesystem::path& pipe,
                                            const std::stop_token& stop);

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
