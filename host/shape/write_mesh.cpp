#include <fmt/format.h>

#include "files/atomic_file.hpp"
#include "qjulia/error.hpp"
#include "qjulia/mesh.hpp"
#include "shape/mesh_extension.hpp"
#include "shape/openmesh_io.hpp"
#include "shape/write_glb.hpp"

namespace qjulia {

void write_mesh(const TriangleMesh& mesh, const std::filesystem::path& path,
                const std::string& note) {
  const bool is_glb = path.extension() == ".glb";
  const std::string extension = is_glb ? ".glb" : mesh_extension(path, "write");
  AtomicFile file(path);
  if (extension == ".obj" && !note.empty()) file.stream() << "# " << note << '\n';
  if (is_glb) {
    write_glb(mesh, note, file.stream());
  } else if (!write_with_openmesh(mesh, extension, file.stream())) {
    throw OutputError(fmt::format("cannot write mesh '{}'; check the space left", path.string()));
  }
  file.commit();
}

}  // namespace qjulia
