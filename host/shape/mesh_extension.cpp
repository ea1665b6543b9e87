#include "shape/mesh_extension.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "qjulia/error.hpp"

namespace qjulia {

std::string mesh_extension(const std::filesystem::path& path, const char* verb) {
  std::string extension = path.extension().string();
  std::ranges::transform(extension, extension.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  constexpr std::array kKnown = {".obj", ".off", ".ply", ".stl"};
  if (std::ranges::find(kKnown, extension) == kKnown.end()) {
    throw InputError(fmt::format(
        "cannot {} mesh '{}': its name must end in .obj, .off, .ply or .stl", verb, path.string()));
  }
  return extension;
}

}  // namespace qjulia
