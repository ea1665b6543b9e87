#pragma once
/// The table of file types that commands read and write. A type is known by its extension, in any
/// case of its letters.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace qjulia::base {

enum class FileContent {
  mesh,
  map,
  original_map,
  sampled_distance,
  picture,
  field,
  volume,  ///< of OpenVDB
  manifest,
  report,
  formula  ///< a map in GLSL, for other programs
};

/// What can be done with a file of a type.
enum class FileUse {
  read,
  write,
  paint,  ///< a mesh file that holds a share of detail for each vertex
  print,  ///< a mesh file for printers, whose mesh must be closed
};

/// The word for the content, as in "map".
const char* to_string(FileContent content);

/// The extension with its dot, in lower case; empty when there is none.
std::string extension_of(const std::filesystem::path& path);

/// What the name promises; none for an extension that is not in the table.
std::optional<FileContent> content_of(const std::filesystem::path& path);

/// Whether files of this name's type can hold a note of how they were made.
bool can_hold_note(const std::filesystem::path& path);

/// Whether the name's extension is that of a file with this content, for this use.
bool has_type(const std::filesystem::path& path, FileContent content, FileUse use);

/// The extensions of all such files.
std::vector<std::string> extensions(FileContent content, FileUse use);

/// The same as a list for people, as in ".npy or .vti".
std::string extension_list(FileContent content, FileUse use);

/// `extension_of` a file that has this type.
/// @throws InputError naming the file and the extensions it could have.
std::string expect_type(const std::filesystem::path& path, FileContent content, FileUse use);

}  // namespace qjulia::base
