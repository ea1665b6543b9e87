#pragma once
/// Files by their names, and what tells whether two are the same.

#include <filesystem>
#include <initializer_list>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "base/file_types.hpp"
#include "base/output_check.hpp"
#include "describe/command_line.hpp"

namespace qjulia::tools {

/// Whether the file is a mesh for commands that take a map or a mesh: by its name, unless it is a
/// scene (.glb) that holds a map. @throws InputError for a scene that cannot be read.
bool is_mesh_file(const std::filesystem::path& path);

/// @throws InputError when the file is a mesh: `option` needs a map.
void expect_map(const std::string& option, const std::filesystem::path& path);

/// The name as a shell takes it for one word, in quotes where it needs them.
std::string shell_word(const std::string& name);

/// A command as a shell takes it. Options and negative numbers keep the dashes that they begin
/// with, which `shell_word` takes for those of a file.
std::string shell_words(const std::vector<std::string>& words);

/// Without its folder, in UTF-8.
std::string name_of(const std::filesystem::path& path);

/// @throws InputError when a map to be written has the name of another type, such as x.png.
void check_map_name(const std::filesystem::path& path);

/// The extensions of files that are read as any of these.
std::vector<std::string> readable(std::initializer_list<base::FileContent> contents);

/// "bunny.png" after "shapes/bunny.qjulia.json" and ".png": what a command writes for an input
/// where nobody names it, in the folder the command runs in.
std::string named_after(const std::string& input, const std::string& extension);

/// A command's main output, to be checked. @param option what the user calls it.
/// @param extensions it must end in one; empty: in any.
base::Output output_named(const std::string& option, const OutputName& name,
                          std::vector<std::string> extensions = {});

/// What a command has written with --json. @param what the user calls it.
/// @throws InputError when it cannot be read, or is no JSON.
nlohmann::json read_report(const std::string& path, const std::string& what);

/// Hexadecimal FNV-1a, 64 bits, of a file's bytes: tells whether two files are the same, and is no
/// protection against somebody who wants them to seem so.
/// http://www.isthe.com/chongo/tech/comp/fnv
/// @throws InputError when the file cannot be read.
std::string file_hash(const std::filesystem::path& path);

/// Hexadecimal FNV-1a, 64 bits, of a text.
std::string text_hash(std::string_view text);

}  // namespace qjulia::tools
