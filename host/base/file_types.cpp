#include "base/file_types.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "base/mesh_formats.hpp"
#include "base/text.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia::base {
namespace {

struct FileType {
  std::string_view extension;
  FileContent content;
  unsigned uses;  ///< see `bit_of`
};

constexpr unsigned bit_of(FileUse use) { return 1U << static_cast<unsigned>(use); }

constexpr unsigned kRead = bit_of(FileUse::read), kWrite = bit_of(FileUse::write),
                   kPaint = bit_of(FileUse::paint), kPrint = bit_of(FileUse::print),
                   kNote = 1U << 31;  ///< the file can hold a note of how it was made

#define QJULIA_FORMAT(name, extension, uses) FileType{extension, FileContent::mesh, uses},
constexpr std::array kTypes = {
    QJULIA_MESH_FORMATS(QJULIA_FORMAT) FileType{".json", FileContent::map, kRead | kWrite},
    FileType{".o3d", FileContent::original_map, kRead},
    FileType{".poly4d", FileContent::original_map, kRead},
    FileType{".f3d", FileContent::sampled_distance, kRead},
    FileType{".png", FileContent::picture, kWrite | kNote},
    FileType{".exr", FileContent::picture, kWrite | kNote},
    FileType{".npy", FileContent::field, kWrite},
    FileType{".vti", FileContent::field, kWrite | kNote},
    FileType{".vdb", FileContent::volume, kWrite | kNote},
    FileType{".toml", FileContent::manifest, kRead},
    FileType{".html", FileContent::report, kWrite},
    FileType{".frag", FileContent::formula, kWrite},
    FileType{".glsl", FileContent::formula, kWrite},
    FileType{".fract", FileContent::formula, kWrite},
    // A page that `share` made, with a map in it.
    FileType{".html", FileContent::map, kRead},
    // Pictures and scenes that hold the map they show.
    FileType{".png", FileContent::map, kRead},
    FileType{".glb", FileContent::map, kRead},
};
#undef QJULIA_FORMAT

bool allows(const FileType& type, FileContent content, FileUse use) {
  return type.content == content && (type.uses & bit_of(use)) != 0;
}

const char* verb_of(FileUse use) {
  switch (use) {
    case FileUse::read:
      return "read";
    case FileUse::write:
      return "write";
    case FileUse::paint:
      return "take paint from";
    case FileUse::print:
      return "print";
  }
  return "";
}

}  // namespace

std::string extension_of(const std::filesystem::path& path) {
  return base::lower_case(path.extension().string());
}

const char* to_string(FileContent content) {
  switch (content) {
    case FileContent::mesh:
      return "mesh";
    case FileContent::map:
      return "map";
    case FileContent::original_map:
      return "original map";
    case FileContent::sampled_distance:
      return "distance field";
    case FileContent::picture:
      return "picture";
    case FileContent::field:
      return "field";
    case FileContent::volume:
      return "volume";
    case FileContent::manifest:
      return "manifest";
    case FileContent::report:
      return "report";
    case FileContent::formula:
      return "formula";
  }
  return "";
}

std::optional<FileContent> content_of(const std::filesystem::path& path) {
  const auto* type = std::ranges::find(kTypes, extension_of(path), &FileType::extension);
  if (type == kTypes.end()) return {};
  return type->content;
}

bool can_hold_note(const std::filesystem::path& path) {
  const std::string extension = extension_of(path);
  return std::ranges::any_of(kTypes, [&](const FileType& type) {
    return type.extension == extension && (type.uses & kNote) != 0;
  });
}

bool has_type(const std::filesystem::path& path, FileContent content, FileUse use) {
  const std::string extension = extension_of(path);
  return std::ranges::any_of(kTypes, [&](const FileType& type) {
    return type.extension == extension && allows(type, content, use);
  });
}

std::vector<std::string> extensions(FileContent content, FileUse use) {
  std::vector<std::string> all;
  for (const FileType& type : kTypes) {
    if (allows(type, content, use)) all.emplace_back(type.extension);
  }
  return all;
}

std::string extension_list(FileContent content, FileUse use) {
  std::string list = fmt::format("{}", fmt::join(extensions(content, use), ", "));
  const std::size_t last = list.rfind(", ");
  return last == std::string::npos ? list : list.replace(last, 2, " or ");
}

std::string expect_type(const std::filesystem::path& path, FileContent content, FileUse use) {
  if (has_type(path, content, use)) return extension_of(path);
  throw InputError(fmt::format("cannot {} {} '{}': its name must end in {}", verb_of(use),
                               to_string(content), path.string(), extension_list(content, use)));
}

}  // namespace qjulia::base
