#include "mesh_io/formats.hpp"

#include <algorithm>
#include <iterator>
#include <stdexcept>

namespace qjulia::shape {

std::span<const MeshFormat> mesh_formats() {
#define QJULIA_FORMAT(name, ending, uses) \
  [] {                                    \
    MeshFormat format = name##_format();  \
    format.extension = ending;            \
    return format;                        \
  }(),
  static const MeshFormat kFormats[] = {QJULIA_MESH_FORMATS(QJULIA_FORMAT)};
#undef QJULIA_FORMAT
  return kFormats;
}

const MeshFormat& mesh_format(std::string_view extension) {
  const auto formats = mesh_formats();
  const auto found = std::ranges::find(formats, extension, &MeshFormat::extension);
  if (found == formats.end()) {
    throw std::logic_error("no mesh format has the extension " + std::string(extension));
  }
  return *found;
}

}  // namespace qjulia::shape
