#include "qjulia/surface/cut_mesh.hpp"

#include <array>
#include <cmath>
#include <map>
#include <utility>

namespace qjulia {

TriangleMesh cut_away(const TriangleMesh& mesh, const Cut& plane, const std::optional<Box>& box) {
  const auto axis = static_cast<Eigen::Index>(plane.axis - 'x');
  const double most = place_of(plane, box);
  mesh.validate();
  constexpr std::uint32_t kNone = 0xFFFFFFFF;
  TriangleMesh cut;
  const auto added = [&](const Eigen::Vector3d& vertex) {
    cut.vertices.push_back(vertex);
    return static_cast<std::uint32_t>(cut.vertices.size() - 1);
  };
  // How far a vertex is below the plane; above 0 it stays.
  const auto below = [&](std::uint32_t v) { return most - mesh.vertices[v][axis]; };
  std::vector<std::uint32_t> numbers(mesh.vertices.size(), kNone);
  const auto kept = [&](std::uint32_t v) {
    if (numbers[v] == kNone) {
      numbers[v] = added(mesh.vertices[v]);
      if (!mesh.normals.empty()) cut.normals.push_back(mesh.normals[v]);
      if (!mesh.colors.empty()) cut.colors.push_back(mesh.colors[v]);
    }
    return numbers[v];
  };
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> crossings;  // by edge
  const auto crossing = [&](std::uint32_t a, std::uint32_t b) {
    // From the same end for both triangles of an edge.
    if (a > b) std::swap(a, b);
    const auto [at, is_new] = crossings.try_emplace({a, b});
    if (!is_new) return at->second;
    const double way = below(a) / (below(a) - below(b));
    Eigen::Vector3d point = mesh.vertices[a] + way * (mesh.vertices[b] - mesh.vertices[a]);
    point[axis] = most;
    if (!mesh.normals.empty()) {
      const auto share = static_cast<float>(way);
      cut.normals.push_back(((1 - share) * mesh.normals[a] + share * mesh.normals[b]).normalized());
    }
    if (!mesh.colors.empty()) {
      VertexColor& color = cut.colors.emplace_back();
      for (std::size_t c = 0; c < color.size(); ++c) {
        color[c] = static_cast<std::uint8_t>(
            std::lround(std::lerp(mesh.colors[a][c], mesh.colors[b][c], way)));
      }
    }
    return at->second = added(point);
  };
  for (const Triangle& triangle : mesh.triangles) {
    // The polygon of what stays, cut into triangles about its first corner.
    std::array<std::uint32_t, 4> corners{};
    std::size_t count = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t a = triangle[i], b = triangle[(i + 1) % 3];
      if (below(a) > 0) corners[count++] = kept(a);
      if ((below(a) > 0) != (below(b) > 0)) corners[count++] = crossing(a, b);
    }
    for (std::size_t i = 2; i < count; ++i) {
      cut.triangles.push_back({corners[0], corners[i - 1], corners[i]});
    }
  }
  return cut;
}

}  // namespace qjulia
