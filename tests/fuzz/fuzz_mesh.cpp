// Mesh files of the type QJULIA_FUZZ_EXTENSION: what is read has triangles, finite coordinates and
// indices in range. With QJULIA_FUZZ_MODEL, of what is the model in a .3mf file.

#include <cstdlib>
#ifdef QJULIA_FUZZ_MODEL
#include "stored_zip.hpp"
#endif

#include "fuzz_file.hpp"
#include "qjulia/mesh/mesh.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
#ifdef QJULIA_FUZZ_MODEL
  const std::string archive = qjulia::test::stored_zip(
      {{"_rels/.rels",
        "<Relationships xmlns='r'><Relationship Target='/m.model' Type='/3dmodel'/>"
        "</Relationships>"},
       {"m.model", std::string(data, data + size)}});
  data = reinterpret_cast<const std::uint8_t*>(archive.data());
  size = archive.size();
#endif
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
