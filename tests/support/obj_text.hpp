#pragma once
#include <sstream>
#include <string>

#include "qjulia/mesh/mesh.hpp"

namespace qjulia::test {

/// A mesh as the text of an .obj file, written here so that tests of reading need no writer.
inline std::string obj_text(const TriangleMesh& mesh) {
  std::ostringstream text;
  text.precision(17);
  for (const auto& v : mesh.vertices) text << "v " << v.x() << ' ' << v.y() << ' ' << v.z() << '\n';
  for (const auto& [a, b, c] : mesh.triangles) {
    text << "f " << a + 1 << ' ' << b + 1 << ' ' << c + 1 << '\n';
  }
  return text.str();
}

}  // namespace qjulia::test
