#pragma once
/// Small meshes with known geometry, made on the spot. Triangles are counter-clockwise from outside
/// unless the name says otherwise.

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <utility>

#include "qjulia/mesh/mesh.hpp"

namespace qjulia::shapes {

/// The same surface with each triangle cut in four at the middles of its edges.
inline TriangleMesh subdivided(TriangleMesh mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
  const auto middle = [&](std::uint32_t a, std::uint32_t b) {
    const auto [found, added] =
        middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(mesh.vertices.size()));
    if (added) mesh.vertices.emplace_back(0.5 * (mesh.vertices[a] + mesh.vertices[b]));
    return found->second;
  };
  std::vector<Triangle> finer;
  for (const auto& [a, b, c] : mesh.triangles) {
    const auto ab = middle(a, b);
    const auto bc = middle(b, c);
    const auto ca = middle(c, a);
    finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
  }
  mesh.triangles = std::move(finer);
  return mesh;
}

/// An icosahedron, each triangle cut in four `subdivisions` times, on the sphere of `radius` about
/// the origin: 20 · 4^subdivisions triangles.
inline TriangleMesh sphere(int subdivisions = 3, double radius = 1) {
  const double g = std::numbers::phi;
  TriangleMesh mesh;
  mesh.vertices = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                   {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  mesh.triangles = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                    {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                    {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                    {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
  for (int level = 0; level < subdivisions; ++level) {
    mesh = subdivided(std::move(mesh));
    for (auto& x : mesh.vertices) x = x.normalized();
  }
  for (auto& x : mesh.vertices) x = radius * x.normalized();
  return mesh;
}

/// A box of two triangles a side.
inline TriangleMesh box(const Eigen::Vector3d& low = {-1, -1, -1},
                        const Eigen::Vector3d& high = {1, 1, 1}) {
  TriangleMesh mesh;
  for (int corner = 0; corner < 8; ++corner) {
    mesh.vertices.emplace_back((corner & 1) != 0 ? high.x() : low.x(),
                               (corner & 2) != 0 ? high.y() : low.y(),
                               (corner & 4) != 0 ? high.z() : low.z());
  }
  mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return mesh;
}

/// A box without its upper z side.
inline TriangleMesh open_box() {
  TriangleMesh mesh = box();
  mesh.triangles.erase(mesh.triangles.begin() + 2, mesh.triangles.begin() + 4);
  return mesh;
}

/// A torus about the z axis: 2 · around · across triangles.
inline TriangleMesh torus(double major = 1, double minor = 0.35, unsigned around = 64,
                          unsigned across = 32) {
  TriangleMesh mesh;
  for (unsigned i = 0; i < around; ++i) {
    const double u = 2 * std::numbers::pi * i / around;
    for (unsigned j = 0; j < across; ++j) {
      const double v = 2 * std::numbers::pi * j / across;
      const double r = major + minor * std::cos(v);
      mesh.vertices.emplace_back(r * std::cos(u), r * std::sin(u), minor * std::sin(v));
      const auto at = [&](unsigned di, unsigned dj) {
        return (i + di) % around * across + (j + dj) % across;
      };
      mesh.triangles.push_back({at(0, 0), at(1, 0), at(1, 1)});
      mesh.triangles.push_back({at(0, 0), at(1, 1), at(0, 1)});
    }
  }
  return mesh;
}

/// Uniform in [-1, 1].
inline double centred(std::mt19937& random) {
  return 2 * static_cast<double>(random()) / static_cast<double>(std::mt19937::max()) - 1;
}

/// The same surface with every triangle turned.
inline TriangleMesh inside_out(TriangleMesh mesh) {
  for (auto& [a, b, c] : mesh.triangles) std::swap(b, c);
  return mesh;
}

/// The same triangles with vertices of their own, each moved by up to `jitter` along each axis.
inline TriangleMesh soup(const TriangleMesh& mesh, double jitter = 0) {
  TriangleMesh out;
  std::mt19937 random(1);
  const auto offset = [&] { return jitter * centred(random); };
  for (const auto& triangle : mesh.triangles) {
    const auto first = static_cast<std::uint32_t>(out.vertices.size());
    for (const auto v : triangle) {
      const double x = offset();
      const double y = offset();
      out.vertices.emplace_back(mesh.vertices[v] + Eigen::Vector3d(x, y, offset()));
    }
    out.triangles.push_back({first, first + 1, first + 2});
  }
  return out;
}

/// The mesh without every `period`-th triangle.
inline TriangleMesh with_holes(const TriangleMesh& mesh, std::size_t period) {
  TriangleMesh out{mesh.vertices, {}};
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (t % period != 0) out.triangles.push_back(mesh.triangles[t]);
  }
  return out;
}

/// x -> scale x + translation.
inline TriangleMesh moved(TriangleMesh mesh, double scale, const Eigen::Vector3d& translation) {
  for (auto& x : mesh.vertices) x = scale * x + translation;
  return mesh;
}

/// Both meshes side by side in one.
inline TriangleMesh joined(TriangleMesh a, const TriangleMesh& b) {
  const auto first = static_cast<std::uint32_t>(a.vertices.size());
  a.vertices.insert(a.vertices.end(), b.vertices.begin(), b.vertices.end());
  for (const auto& [i, j, k] : b.triangles) {
    a.triangles.push_back({first + i, first + j, first + k});
  }
  return a;
}

}  // namespace qjulia::shapes
