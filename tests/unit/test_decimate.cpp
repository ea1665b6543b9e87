// Meshes of fewer triangles.

#include <algorithm>
#include <catch2/catch_all.hpp>
#include <cmath>
#include <stop_token>

#include "mesh/decimate_blocks.hpp"
#include "mesh/surface_samples.hpp"
#include "mesh/triangle_tree.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/mesh/decimate.hpp"
#include "shapes.hpp"

using namespace qjulia;

TEST_CASE("a decimated sphere is a closed sphere still") {
  TriangleMesh sphere = shapes::sphere(5);
  for (const Eigen::Vector3d& x : sphere.vertices) sphere.normals.emplace_back(x.cast<float>());
  const TriangleMesh found = decimated(sphere, 2000);
  CHECK(found.triangles.size() <= 2000);
  CHECK(found.triangles.size() >= 1990);
  CHECK(inspect(found).closed());
  CHECK(inspect(found).components == 1);
  CHECK(signed_volume(found) == Catch::Approx(signed_volume(sphere)).epsilon(0.01));
  for (const Eigen::Vector3d& x : found.vertices) CHECK(x.norm() == Catch::Approx(1).epsilon(1e-3));
  REQUIRE(found.normals.size() == found.vertices.size());
  for (std::size_t i = 0; i < found.vertices.size(); ++i) {
    CHECK(found.normals[i].cast<double>().dot(found.vertices[i]) > 0.98);
  }
}

TEST_CASE("a decimated mesh has the mean colours of the vertices that went into each") {
  TriangleMesh sphere = shapes::sphere(5);
  // Red tells the side; green is 0 or 200 from vertex to vertex.
  for (std::size_t v = 0; v < sphere.vertices.size(); ++v) {
    const std::uint8_t red = sphere.vertices[v].z() > 0 ? 255 : 0;
    sphere.colors.push_back({red, static_cast<std::uint8_t>(v * 7919 % 2 * 200), 9});
  }
  const TriangleMesh found = decimated(sphere, 200);
  REQUIRE(found.colors.size() == found.vertices.size());
  for (std::size_t v = 0; v < found.vertices.size(); ++v) {
    const auto& [red, green, blue] = found.colors[v];
    if (std::abs(found.vertices[v].z()) > 0.4) CHECK(red == (found.vertices[v].z() > 0 ? 255 : 0));
    CHECK(green > 50);
    CHECK(green < 150);
    CHECK(blue == 9);
  }
  CHECK(decimated(sphere, 30'000).colors == sphere.colors);
}

TEST_CASE("flat places lose their triangles first") {
  // A box of 8 corners, each of its sides cut into many triangles.
  TriangleMesh box = shapes::box();
  for (int level = 0; level < 4; ++level) box = shapes::subdivided(box);
  const TriangleMesh found = decimated(box, 60);
  CHECK(found.triangles.size() <= 60);
  CHECK(signed_volume(found) == Catch::Approx(8));
  CHECK(found.box().low == Eigen::Vector3d(-1, -1, -1));
  CHECK(found.box().high == Eigen::Vector3d(1, 1, 1));
  CHECK(found.normals.empty());
}

namespace {

/// The farthest of the vertices of `from`, and of points on it, from `to`.
double farthest(const TriangleMesh& from, const TriangleMesh& to) {
  const shape::TriangleTree tree(to);
  double distance = 0;
  for (const Eigen::Vector3d& x : from.vertices) {
    distance = std::max(distance, tree.nearest(x).distance);
  }
  for (const shape::TrianglePoint& point : shape::sample_triangles(from, 20'000, 1)) {
    distance = std::max(distance, tree.nearest(point.position(from)).distance);
  }
  return distance;
}

}  // namespace

TEST_CASE("a decimated mesh stays within the error, both ways") {
  const TriangleMesh torus = shapes::torus(1, 0.35, 256, 128);
  std::size_t before = torus.triangles.size();
  for (const double error : {0.004, 0.016}) {
    const TriangleMesh found = decimated(torus, {std::nullopt, error});
    CAPTURE(error, found.triangles.size());
    CHECK(found.triangles.size() < before / 2);
    before = found.triangles.size();
    CHECK(inspect(found).closed());
    CHECK(farthest(torus, found) <= 1.1 * error);
    CHECK(farthest(found, torus) <= 1.1 * error);
    CHECK(farthest(torus, found) > 0.2 * error);
  }
  // The number is reached before the error is.
  CHECK(decimated(torus, {20'000, 0.016}).triangles.size() > 19'990);
}

TEST_CASE("few points between those that are measured lie beyond the error") {
  TriangleMesh sphere = shapes::sphere(5);
  for (std::size_t v = 0; v < sphere.vertices.size(); ++v) {
    sphere.vertices[v] *= 1 + 0.01 * std::sin(7919.0 * static_cast<double>(v));
  }
  constexpr double kError = 0.01;
  const TriangleMesh found = decimated(sphere, {std::nullopt, kError});
  CHECK(found.triangles.size() < sphere.triangles.size());
  const shape::TriangleTree tree(sphere);
  int beyond = 0;
  for (const shape::TrianglePoint& point : shape::sample_triangles(found, 200'000, 1)) {
    if (tree.nearest(point.position(found)).distance > kError) ++beyond;
  }
  CHECK(beyond < 10);
}

TEST_CASE("a surface as rough as the error loses triangles where it is smoother than that") {
  // One half of this sphere is smooth, and the vertices of the other are off it by up to 0.03.
  TriangleMesh sphere = shapes::sphere(5);
  for (std::size_t v = 0; v < sphere.vertices.size(); ++v) {
    if (sphere.vertices[v].z() <= 0) continue;
    sphere.vertices[v] *= 1 + 0.03 * std::sin(7919.0 * static_cast<double>(v));
  }
  constexpr double kError = 0.01;
  const Decimation found = decimate(sphere, {std::nullopt, kError});
  CHECK(inspect(found.mesh).closed());
  CHECK(found.report.end == DecimationEnd::error);
  CHECK(found.report.before == sphere.triangles.size());
  CHECK(found.report.after == found.mesh.triangles.size());
  CHECK(10 * found.report.after < 7 * found.report.before);
  CHECK(found.report.farthest <= kError);
  CHECK(farthest(sphere, found.mesh) <= 1.1 * kError);
  CHECK(farthest(found.mesh, sphere) <= 1.1 * kError);
  // Whichever limit is reached first ends it.
  CHECK(decimate(sphere, {18'000, kError}).report.end == DecimationEnd::number);
  CHECK(decimate(sphere, {20, kError}).report.end == DecimationEnd::error);
  CHECK(decimate(sphere, {30'000, kError}).report.end == DecimationEnd::none);
}

TEST_CASE("blocks fit together") {
  TriangleMesh torus = shapes::torus(1, 0.35, 128, 64);
  torus.colors.assign(torus.vertices.size(), {1, 2, 3});
  const TriangleMesh found = shape::decimated_in_blocks(torus, {6000, std::nullopt}, 3000, {});
  const MeshReport report = inspect(found);
  CHECK(report.closed());
  CHECK(report.components == 1);
  CHECK(report.vertices + report.triangles == 3 * report.vertices);  // of a torus
  CHECK(found.triangles.size() < 6600);  // some vertices between blocks stay
  CHECK(found.triangles.size() >= 1990);
  CHECK(signed_volume(found) == Catch::Approx(signed_volume(torus)).epsilon(0.02));
  CHECK(found.colors == std::vector<VertexColor>(found.vertices.size(), {1, 2, 3}));
}

TEST_CASE("a mesh that is small enough comes back as it is") {
  const TriangleMesh box = shapes::box();
  const TriangleMesh found = decimated(box, 12);
  CHECK(found.vertices == box.vertices);
  CHECK(found.triangles == box.triangles);
}

TEST_CASE("a mesh that is not manifold is refused, and a stop is heard") {
  TriangleMesh fan = shapes::box();
  fan.vertices.emplace_back(0, 0, 5);
  fan.triangles.push_back({fan.triangles[0][0], fan.triangles[0][1], 8});
  CHECK_THROWS_WITH(decimated(fan, 4), Catch::Matchers::ContainsSubstring("manifold"));
  std::stop_source source;
  source.request_stop();
  CHECK_THROWS_AS(decimated(shapes::sphere(3), 100, source.get_token()), Interrupted);
}
