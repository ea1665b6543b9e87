// Mesh files of the type QJULIA_FUZZ_EXTENSION: what is read has triangles, finite coordinates and
// indices in range.

#include <cstdlib>

#include "fuzz_file.hpp"
#include "qjulia/mesh.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return qjulia::test::fuzz_file(data, size, QJULIA_FUZZ_EXTENSION, [](const auto& file) {
    const auto mesh = qjulia::read_mesh(file);
    if (mesh.triangles.empty()) std::abort();
    for (const auto& vertex : mesh.vertices) {
      if (!vertex.allFinite()) std::abort();
    }
    for (const auto& triangle : mesh.triangles) {
      for (const auto v : triangle) {
        if (v >= mesh.vertices.size()) std::abort();
      }
    }
  });
}
