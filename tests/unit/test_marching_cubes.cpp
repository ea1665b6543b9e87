#include <algorithm>
#include <array>
#include <catch2/catch_all.hpp>
#include <limits>
#include <random>
#include <vector>

#include "edge_count.hpp"
#include "surface/cube_cases.hpp"
#include "surface/marching_cubes.hpp"

using namespace qjulia;

namespace {

constexpr double kNoClamp = std::numeric_limits<double>::infinity();

/// Values on n³ points, x fastest; `outside` on the boundary.
template <class F>
std::vector<float> field(int n, float outside, F f) {
  std::vector<float> values;
  for (int z = 0; z < n; ++z) {
    for (int y = 0; y < n; ++y) {
      for (int x = 0; x < n; ++x) {
        const auto [low, high] = std::minmax({x, y, z});
        values.push_back(low == 0 || high == n - 1 ? outside : f(x, y, z));
      }
    }
  }
  return values;
}

TriangleMesh mesh_of(const std::vector<float>& values, int n, double level, double reach) {
  surface::Grid grid;
  grid.points = {n, n, n};
  surface::MarchingCubes cubes(grid.points, level, {.reach = reach});
  MeshSink sink;
  surface::MeshBuilder builder(grid, {}, sink);
  const surface::Slab slab = surface::unclassified_slab(grid, n);
  const auto slice = static_cast<std::size_t>(n * n);
  std::size_t open_edges = 0;
  for (int z = 0; z < n; ++z) {
    cubes.add(std::span(values).subspan(static_cast<std::size_t>(z) * slice, slice), slab);
    // Parts of every size.
    if (z % 3 == 1 && z + 1 < n) continue;
    const surface::MeshPart part = cubes.take();
    open_edges += part.open_edges;
    builder.add(part);
  }
  CHECK(sink.mesh.vertices.size() == builder.vertices());
  CHECK(sink.mesh.normals.size() == builder.vertices());
  CHECK(test::count_edges(sink.mesh).open == open_edges);
  return std::move(sink.mesh);
}

/// The same edge seen from the cell on the other side of the face across `axis`.
std::uint8_t shifted(std::uint8_t edge, int axis) {
  const surface::CubeEdge& e = surface::cube_edges()[edge];
  const auto found =
      std::ranges::find_if(surface::cube_edges(), [&](const surface::CubeEdge& other) {
        return other.axis == e.axis && other.low == (e.low ^ 1 << axis);
      });
  return static_cast<std::uint8_t>(found - surface::cube_edges().begin());
}

/// Sides of a loop's triangles that are no segments of the loop, yet lie on a face of the cell.
int chords_on_faces(const surface::CubeLoop& loop) {
  const auto corners = [](std::uint8_t e) {
    const surface::CubeEdge& edge = surface::cube_edges()[e];
    return std::array{edge.low, edge.high};
  };
  const auto on_face = [&](std::uint8_t edge, int face) {
    return std::ranges::all_of(corners(edge),
                               [face](int corner) { return (corner >> face / 2 & 1) == face % 2; });
  };
  int chords = 0;
  for (std::size_t i = 0; i < loop.triangles.size(); ++i) {
    const std::uint8_t from = loop.triangles[i];
    const std::uint8_t to = loop.triangles[i / 3 * 3 + (i + 1) % 3];
    const auto at = std::ranges::find(loop.edges, from) - loop.edges.begin();
    const auto size = static_cast<std::ptrdiff_t>(loop.edges.size());
    const auto edge = [&](std::ptrdiff_t k) {
      return loop.edges[static_cast<std::size_t>((k + size) % size)];
    };
    if (edge(at + 1) == to || edge(at - 1) == to) continue;
    for (int face = 0; face < 6; ++face) chords += on_face(from, face) && on_face(to, face) ? 1 : 0;
  }
  return chords;
}

}  // namespace

TEST_CASE("the segments on a face are the neighbour's, reversed") {
  int faces = 0;
  for (unsigned inside = 0; inside < 256; ++inside) {
    for (unsigned other = 0; other < 256; ++other) {
      for (int axis = 0; axis < 3; ++axis) {
        // `other` is the cell above `inside` along the axis: they share four corners.
        bool match = true;
        for (unsigned c = 0; c < 8; ++c) {
          if ((c >> axis & 1U) == 0) continue;
          match = match && (inside >> c & 1U) == (other >> (c ^ 1U << axis) & 1U);
        }
        if (!match) continue;
        ++faces;
        auto mine = surface::face_segments(inside, 2 * axis + 1);
        std::vector<std::array<std::uint8_t, 2>> theirs;
        for (const auto& [from, to] : surface::face_segments(other, 2 * axis)) {
          theirs.push_back({shifted(to, axis), shifted(from, axis)});
        }
        std::ranges::sort(mine);
        std::ranges::sort(theirs);
        REQUIRE(mine == theirs);
      }
    }
  }
  CHECK(faces == 3 * 16 * 16 * 16);
}

TEST_CASE("every crossed edge lies on one loop, and no inner edge on a face") {
  for (unsigned inside = 0; inside < 256; ++inside) {
    std::array<int, 12> seen{};
    for (const surface::CubeLoop& loop : surface::cube_cases()[inside]) {
      CHECK(loop.edges.size() >= 3);
      for (const auto edge : loop.edges) ++seen[edge];
      CHECK(loop.triangles.size() == 3 * (loop.edges.size() - 2));
      CHECK(chords_on_faces(loop) == 0);
    }
    for (std::size_t e = 0; e < 12; ++e) {
      const surface::CubeEdge& edge = surface::cube_edges()[e];
      const bool crossed = (inside >> edge.low & 1U) != (inside >> edge.high & 1U);
      CHECK(seen[e] == (crossed ? 1 : 0));
    }
  }
}

TEST_CASE("a random field has a closed manifold surface") {
  constexpr int n = 24;
  const auto density = GENERATE(0.2, 0.5, 0.8);
  std::mt19937 random(7);
  std::bernoulli_distribution inside(density);
  std::uniform_real_distribution<float> size(0.0F, 1.0F);
  const auto values =
      field(n, 1.0F, [&](int, int, int) { return inside(random) ? -size(random) : size(random); });
  const TriangleMesh mesh = mesh_of(values, n, 0, kNoClamp);
  test::require_closed_manifold(mesh);
  for (const Triangle& t : mesh.triangles) CHECK(test::triangle_area(mesh, t) > 0);
}

TEST_CASE("values at, far from and without relation to the level give distinct vertices") {
  constexpr int n = 20;
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  constexpr float infinity = std::numeric_limits<float>::infinity();
  const std::array<float, 8> choices{0.5F, 0.5F, -1e30F, 1e30F, nan, -infinity, infinity, 0.4999F};
  std::mt19937 random(3);
  const auto values =
      field(n, 1.0F, [&](int, int, int) { return choices[random() % choices.size()]; });
  const auto reach = GENERATE(2.0, kNoClamp);
  const TriangleMesh mesh = mesh_of(values, n, 0.5, reach);
  test::require_closed_manifold(mesh);
  std::vector<std::array<double, 3>> positions;
  for (const auto& v : mesh.vertices) {
    CHECK(v.allFinite());
    positions.push_back({v.x(), v.y(), v.z()});
  }
  std::ranges::sort(positions);
  CHECK(std::ranges::adjacent_find(positions) == positions.end());
}

TEST_CASE("a ball has the volume and area of a ball") {
  constexpr int n = 41;
  constexpr double radius = 17.3;
  const auto ball = field(n, 100.0F, [&](int x, int y, int z) {
    const Eigen::Vector3d d = Eigen::Vector3d(x, y, z) - Eigen::Vector3d(20, 19.7, 20.2);
    return static_cast<float>(d.norm() - radius + 3);
  });
  const TriangleMesh mesh = mesh_of(ball, n, 3, kNoClamp);
  test::require_closed_manifold(mesh);
  const double area = 4 * M_PI * radius * radius;
  CHECK(test::enclosed_volume(mesh) == Catch::Approx(area * radius / 3).epsilon(0.003));
  CHECK(test::surface_area(mesh) == Catch::Approx(area).epsilon(0.003));
  // Euler's formula for a sphere.
  CHECK(mesh.vertices.size() + mesh.triangles.size() == test::count_edges(mesh).edges + 2);
}

TEST_CASE("differences are clamped to the reach before interpolation") {
  const auto values = field(3, 1.0F, [](int, int, int) { return -100.0F; });
  const TriangleMesh mesh = mesh_of(values, 3, 0, 2);
  REQUIRE(mesh.vertices.size() == 6);
  for (const auto& v : mesh.vertices) {
    CHECK((v - Eigen::Vector3d::Ones()).norm() == Catch::Approx(2.0 / 3));
  }
}

TEST_CASE("the surface is open only where it meets the grid's boundary") {
  const std::vector<float> values(4 * 4 * 4, -1.0F);
  auto half = values;
  std::fill(half.begin() + 32, half.end(), 1.0F);
  CHECK(mesh_of(values, 4, 0, kNoClamp).triangles.empty());
  const TriangleMesh mesh = mesh_of(half, 4, 0, kNoClamp);
  const auto count = test::count_edges(mesh);
  CHECK(count.open == 12);
  CHECK(count.badly_shared == 0);
}
