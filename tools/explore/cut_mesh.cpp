#include "explore/cut_mesh.hpp"

#include <map>
#include <utility>

namespace qjulia::explore {
namespace {

/// Vertices of the mesh and of the plane, each once.
class Cutter {
 public:
  Cutter(const TriangleMesh& mesh, int axis, double most)
      : mesh_(mesh), axis_(axis), most_(most), numbers_(mesh.vertices.size(), kNone) {}

  TriangleMesh cut() {
    for (const Triangle& triangle : mesh_.triangles) add(triangle);
    return std::move(cut_);
  }

 private:
  static constexpr std::uint32_t kNone = 0xFFFFFFFF;

  /// How far vertex v is below the plane; above 0 it stays.
  double below(std::uint32_t v) const { return most_ - mesh_.vertices[v][axis_]; }

  /// The polygon of what stays, cut into triangles about its first corner.
  void add(const Triangle& triangle) {
    std::array<std::uint32_t, 4> corners{};
    std::size_t count = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t a = triangle[i], b = triangle[(i + 1) % 3];
      if (below(a) > 0) corners[count++] = kept(a);
      if ((below(a) > 0) != (below(b) > 0)) corners[count++] = crossing(a, b);
    }
    for (std::size_t i = 2; i < count; ++i) {
      cut_.triangles.push_back({corners[0], corners[i - 1], corners[i]});
    }
  }

  std::uint32_t kept(std::uint32_t v) {
    if (numbers_[v] == kNone) {
      numbers_[v] = static_cast<std::uint32_t>(cut_.vertices.size());
      cut_.vertices.push_back(mesh_.vertices[v]);
      if (!mesh_.normals.empty()) cut_.normals.push_back(mesh_.normals[v]);
    }
    return numbers_[v];
  }

  std::uint32_t crossing(std::uint32_t a, std::uint32_t b) {
    // From the same end for both triangles of an edge.
    if (a > b) std::swap(a, b);
    const auto [at, is_new] =
        crossings_.try_emplace({a, b}, static_cast<std::uint32_t>(cut_.vertices.size()));
    if (!is_new) return at->second;
    const double way = below(a) / (below(a) - below(b));
    Eigen::Vector3d point = mesh_.vertices[a] + way * (mesh_.vertices[b] - mesh_.vertices[a]);
    point[axis_] = most_;
    cut_.vertices.push_back(point);
    if (!mesh_.normals.empty()) {
      const auto share = static_cast<float>(way);
      cut_.normals.push_back(
          ((1 - share) * mesh_.normals[a] + share * mesh_.normals[b]).normalized());
    }
    return at->second;
  }

  const TriangleMesh& mesh_;
  Eigen::Index axis_;
  double most_;
  std::vector<std::uint32_t> numbers_;  ///< in `cut_`, of the mesh's vertices
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> crossings_;  ///< by edge
  TriangleMesh cut_;
};

}  // namespace

TriangleMesh cut_away(const TriangleMesh& mesh, int axis, double most) {
  return Cutter(mesh, axis, most).cut();
}

}  // namespace qjulia::explore
