#include "base/file_types.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "base/text.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia::base {
namespace {

struct FileType {
  std::string_view extension;
  FileContent content;
  bool is_read;
  bool is_written;
};

constexpr std::array kTypes = {
    FileType{".obj", FileContent::mesh, true, true},
    FileType{".off", FileContent::mesh, true, true},
    FileType{".ply", FileContent::mesh, true, true},
    FileType{".stl", FileContent::mesh, true, true},
    FileType{".glb", FileContent::mesh, true, true},
    FileType{".gltf", FileContent::mesh, true, false},
    FileType{".3mf", FileContent::mesh, true, true},
    FileType{".usda", FileContent::mesh, false, true},
    FileType{".json", FileContent::map, true, true},
    FileType{".o3d", FileContent::original_map, true, false},
    FileType{".poly4d", FileContent::original_map, true, false},
    FileType{".f3d", FileContent::sampled_distance, true, false},
    FileType{".png", FileContent::picture, false, true},
    FileType{".npy", FileContent::field, false, true},
    FileType{".vti", FileContent::field, false, true},
    FileType{".vdb", FileContent::volume, false, true},
    FileType{".toml", FileContent::manifest, true, false},
    FileType{".html", FileContent::report, false, true},
    FileType{".frag", FileContent::formula, false, true},
    FileType{".glsl", FileContent::formula, false, true},
    FileType{".fract", FileContent::formula, false, true},
    // A page that `share` made, with a map in it.
    FileType{".html", FileContent::map, true, false},
    // Pictures and scenes that hold the map they show.
    FileType{".png", FileContent::map, true, false},
    FileType{".glb", FileContent::map, true, false},
};

bool allows(const FileType& type, FileContent content, FileUse use) {
  return type.content == content && (use == FileUse::read ? type.is_read : type.is_written);
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
  throw InputError(fmt::format("cannot {} {} '{}': its name must end in {}",
                               use == FileUse::read ? "read" : "write", to_string(content),
                               path.string(), extension_list(content, use)));
}

}  // namespace qjulia::base
