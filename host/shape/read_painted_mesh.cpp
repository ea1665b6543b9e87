#include <fmt/format.h>

#include "qjulia/error.hpp"
#include "qjulia/file_types.hpp"
#include "qjulia/painted_mesh.hpp"
#include "shape/mesh_file.hpp"
#include "shape/triangulate.hpp"

namespace qjulia {

PaintedMesh read_painted_mesh(const std::filesystem::path& path, const std::string& property,
                              std::stop_token stop) {
  const std::string extension = expect_type(path, FileContent::mesh, FileUse::read);
  if (extension != ".ply" && extension != ".obj") {
    throw InputError(
        fmt::format("cannot paint by '{}': only .ply and .obj files hold colors", path.string()));
  }
  try {
    const shape::MeshFile file(path, extension, std::move(stop));
    shape::FaceList faces =
        extension == ".ply" ? shape::read_ply(file, &property) : shape::read_obj(file, &property);
    for (const auto& [first, count] : faces.polygons) {
      shape::triangulate(faces.vertices, std::span(faces.triangles).subspan(first, count),
                         [&] { file.poll(); });
    }
    return {std::move(faces.vertices), std::move(faces.triangles), std::move(faces.shares)};
  } catch (const std::bad_alloc&) {
    throw InputError(
        fmt::format("cannot read mesh '{}': there is not enough memory for it", path.string()));
  }
}

}  // namespace qjulia
