#pragma once
/// Counts a mesh's edges by how its triangles use them; independent of the library's mesh room.

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <catch2/catch_all.hpp>
#include <cstddef>
#include <map>
#include <set>
#include <utility>

#include "qjulia/mesh/mesh.hpp"

namespace qjulia::test {

struct EdgeCount {
  std::size_t edges = 0;
  std::size_t open = 0;          ///< one triangle
  std::size_t badly_shared = 0;  ///< more than two, or two that run the same way
};

inline EdgeCount count_edges(const TriangleMesh& mesh) {
  // For each edge, rising vertices first: triangles that run along it and against it.
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::array<int, 2>> uses;
  for (const Triangle& t : mesh.triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      const auto a = t[i];
      const auto b = t[(i + 1) % 3];
      ++uses[std::minmax(a, b)][a < b ? 0 : 1];
    }
  }
  EdgeCount count;
  count.edges = uses.size();
  for (const auto& [edge, use] : uses) {
    if (use[0] + use[1] == 1) {
      ++count.open;
    } else if (use[0] != 1 || use[1] != 1) {
      ++count.badly_shared;
    }
  }
  return count;
}

/// Vertices where the triangles around do not make one fan.
inline std::size_t pinched_vertices(const TriangleMesh& mesh) {
  std::map<std::uint32_t, std::map<std::uint32_t, std::uint32_t>> around;
  std::map<std::uint32_t, std::size_t> degree;
  for (const Triangle& t : mesh.triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      around[t[i]][t[(i + 1) % 3]] = t[(i + 2) % 3];
      ++degree[t[i]];
    }
  }
  std::size_t pinched = 0;
  for (const auto& [vertex, next] : around) {
    std::size_t steps = 0;
    auto at = next.begin()->first;
    do {
      const auto found = next.find(at);
      if (found == next.end()) break;
      at = found->second;
      ++steps;
    } while (at != next.begin()->first);
    if (steps != degree[vertex]) ++pinched;
  }
  return pinched;
}

inline void require_closed_manifold(const TriangleMesh& mesh) {
  const auto count = count_edges(mesh);
  REQUIRE(count.edges > 0);
  REQUIRE(count.open == 0);
  REQUIRE(count.badly_shared == 0);
  REQUIRE(pinched_vertices(mesh) == 0);
}

inline double enclosed_volume(const TriangleMesh& mesh) {
  double six_times = 0;
  for (const Triangle& t : mesh.triangles) {
    six_times += mesh.vertices[t[0]].dot(mesh.vertices[t[1]].cross(mesh.vertices[t[2]]));
  }
  return six_times / 6;
}

inline double triangle_area(const TriangleMesh& mesh, const Triangle& t) {
  const auto& a = mesh.vertices[t[0]];
  return 0.5 * (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a).norm();
}

inline double surface_area(const TriangleMesh& mesh) {
  double area = 0;
  for (const Triangle& t : mesh.triangles) area += triangle_area(mesh, t);
  return area;
}

}  // namespace qjulia::test
