// Meshes that are cut open.

#include <catch2/catch_all.hpp>
#include <cmath>

#include "qjulia/base/error.hpp"
#include "qjulia/surface/cut_mesh.hpp"

using namespace qjulia;

TEST_CASE("a mesh is cut along planes") {
  // An octahedron, whose lower half is four triangles and whose section is a square.
  TriangleMesh mesh;
  for (const double side : {-1.0, 1.0}) {
    for (int axis = 0; axis < 3; ++axis)
      mesh.vertices.push_back(side * Eigen::Vector3d::Unit(axis));
  }
  mesh.triangles = {{3, 4, 5}, {4, 0, 5}, {0, 1, 5}, {1, 3, 5},
                    {4, 3, 2}, {0, 4, 2}, {1, 0, 2}, {3, 1, 2}};
  for (const Eigen::Vector3d& v : mesh.vertices) {
    mesh.normals.push_back(v.cast<float>());
    const auto grey = static_cast<std::uint8_t>(100 + 100 * v.z());
    mesh.colors.push_back({grey, grey, 7});
  }
  REQUIRE(inspect(mesh).closed());
  for (const double most : {-0.5, 0.0, 0.5}) {
    const TriangleMesh cut = cut_away(mesh, {'z', most}, std::nullopt);
    const MeshReport report = inspect(cut);
    CHECK(report.open_edges == 4);
    CHECK(report.non_manifold_edges == 0);
    CHECK(cut.box().high.z() == most);
    CHECK(cut.box().low.z() == -1);
    CHECK(cut.normals.size() == cut.vertices.size());
    REQUIRE(cut.colors.size() == cut.vertices.size());
    for (std::size_t v = 0; v < cut.vertices.size(); ++v) {
      CHECK(std::abs(cut.colors[v][0] - (100 + 100 * cut.vertices[v].z())) <= 1);
      CHECK(cut.colors[v][2] == 7);
    }
    double area = 0;
    for (const Triangle& t : cut.triangles) {
      const Eigen::Vector3d a = cut.vertices[t[1]] - cut.vertices[t[0]];
      const Eigen::Vector3d normal = a.cross(cut.vertices[t[2]] - cut.vertices[t[0]]);
      CHECK(normal.dot(cut.vertices[t[0]]) > 0);
      area += 0.5 * normal.norm();
    }
    // Of each face, a triangle of area √3 / 2, what is above is a smaller one, or below.
    const double part = (1 - std::abs(most)) * (1 - std::abs(most));
    const double faces = most > 0 ? 8 - 4 * part : 4 * part;
    CHECK(area == Catch::Approx(faces * std::sqrt(3) / 2));
  }
  CHECK(cut_away(mesh, {'x', 2}, std::nullopt).triangles.size() == mesh.triangles.size());
  CHECK(cut_away(mesh, {'x', -2}, std::nullopt).triangles.empty());
  const Box box{{-2, -2, -2}, {2, 2, 2}};
  CHECK(cut_away(mesh, {'y', 75, true}, box).box().high.y() == 1);
  CHECK(cut_away(mesh, {'y', 62.5, true}, box).box().high.y() == 0.5);
  CHECK_THROWS_AS(cut_away(mesh, {'y', 50, true}, std::nullopt), OptionError);
}
