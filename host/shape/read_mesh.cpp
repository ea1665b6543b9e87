#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <unordered_map>

#include "qjulia/error.hpp"
#include "qjulia/mesh.hpp"
#include "shape/mesh_extension.hpp"
#include "shape/openmesh_io.hpp"

namespace qjulia {
namespace {

CheckedMesh check(const RawMeshFile& file, const std::string& extension) {
  if (extension == ".obj") return check_obj(file);
  if (extension == ".off") return check_off(file);
  if (extension == ".ply") return check_ply(file);
  return check_stl(file);
}

/// Equal bits, and so a strict and repeatable equality; zeros have one sign.
struct PointKey {
  std::array<std::uint64_t, 3> bits;
  explicit PointKey(const Eigen::Vector3d& x) {
    for (std::size_t i = 0; i < 3; ++i) {
      bits[i] = std::bit_cast<std::uint64_t>(x[static_cast<Eigen::Index>(i)] + 0.0);
    }
  }
  bool operator==(const PointKey&) const = default;
};

struct PointHash {
  std::size_t operator()(const PointKey& key) const {
    std::uint64_t hash = 0;
    for (const auto b : key.bits) hash = (std::rotl(hash, 21) ^ b) * 0x9e3779b97f4a7c15U;
    return static_cast<std::size_t>(hash ^ (hash >> 32));
  }
};

/// A triangle whose height is below rounding error of its longest side.
bool has_no_area(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  constexpr double kRounding = 1e-12;
  const double side =
      std::max({(b - a).squaredNorm(), (c - a).squaredNorm(), (c - b).squaredNorm()});
  return (b - a).cross(c - a).norm() <= kRounding * side;
}

/// Gives equal vertices one index and leaves out triangles without area and vertices no triangle
/// uses.
TriangleMesh clean(const TriangleMesh& raw, MeshReport& report) {
  TriangleMesh mesh;
  std::unordered_map<PointKey, std::uint32_t, PointHash> places;
  std::vector<std::uint32_t> first_equal(raw.vertices.size());
  for (std::uint32_t v = 0; v < raw.vertices.size(); ++v) {
    const auto [place, added] = places.try_emplace(PointKey(raw.vertices[v]), v);
    first_equal[v] = place->second;
    if (!added) ++report.welded_vertices;
  }
  constexpr std::uint32_t kUnused = ~0U;
  std::vector<std::uint32_t> index(raw.vertices.size(), kUnused);
  for (const auto& triangle : raw.triangles) {
    const auto& x = raw.vertices;
    if (has_no_area(x[triangle[0]], x[triangle[1]], x[triangle[2]])) {
      ++report.dropped_triangles;
      continue;
    }
    Triangle welded;
    std::ranges::transform(triangle, welded.begin(), [&](std::uint32_t v) {
      auto& place = index[first_equal[v]];
      if (place == kUnused) {
        place = static_cast<std::uint32_t>(mesh.vertices.size());
        mesh.vertices.push_back(x[v]);
      }
      return place;
    });
    mesh.triangles.push_back(welded);
  }
  return mesh;
}

}  // namespace

TriangleMesh read_mesh(const std::filesystem::path& path, MeshReport* report) {
  const std::string extension = mesh_extension(path, "read");
  const RawMeshFile file = load_mesh_file(path);
  const CheckedMesh checked = check(file, extension);
  TriangleMesh raw;
  if (!read_with_openmesh(checked, extension, raw)) {
    file.refuse("OpenMesh does not understand it; export it again, for example as binary .ply");
  }
  MeshReport reading;
  TriangleMesh mesh = clean(raw, reading);
  if (mesh.triangles.empty()) {
    file.refuse("none of its triangles has an area (are all vertices equal or in one line?)");
  }
  if (report != nullptr) {
    *report = inspect(mesh);
    report->welded_vertices = reading.welded_vertices;
    report->dropped_triangles = reading.dropped_triangles + checked.dropped_faces;
  }
  return mesh;
}

}  // namespace qjulia
