#include "files.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <fstream>
#include <string>

#include "files/atomic_file.hpp"
#include "files/fnv_hash.hpp"
#include "qjulia/error.hpp"

namespace qjulia::tools {
namespace {

bool ends_in(const std::filesystem::path& path, std::initializer_list<const char*> extensions) {
  std::string extension = path.extension().string();
  std::ranges::transform(extension, extension.begin(),
                         [](unsigned char c) { return std::tolower(c); });
  return std::ranges::find(extensions, extension) != extensions.end();
}

}  // namespace

void require_writable(const std::filesystem::path& path) {
  if (std::filesystem::is_directory(path)) {
    throw OutputError(fmt::format("cannot write '{}': it is a folder", path.string()));
  }
  const AtomicFile trial(path);
}

void require_extension(const std::filesystem::path& path,
                       std::initializer_list<const char*> extensions) {
  if (ends_in(path, extensions)) return;
  std::string list;
  for (const char* extension : extensions)
    list += std::string(list.empty() ? "" : ", ") + extension;
  throw InputError(fmt::format("--output '{}' must end in {}", path.string(), list));
}

bool is_mesh_file(const std::filesystem::path& path) {
  return ends_in(path, {".obj", ".off", ".ply", ".stl"});
}

bool is_original_file(const std::filesystem::path& path) { return ends_in(path, {".o3d"}); }

std::string file_hash(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  FnvHash hash;
  std::array<char, 65536> block;
  while (file.read(block.data(), block.size()) || file.gcount() > 0) {
    hash.add(std::string_view(block.data(), static_cast<std::size_t>(file.gcount())));
  }
  if (!file.eof()) throw InputError(fmt::format("cannot read '{}'", path.string()));
  return hash.text();
}

std::string text_hash(std::string_view text) {
  FnvHash hash;
  hash.add(text);
  return hash.text();
}

}  // namespace qjulia::tools
