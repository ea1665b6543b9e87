// Points with normals as a surface.

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <catch2/catch_all.hpp>
#include <numbers>
#include <random>

#include "mesh/cone_sum.hpp"
#include "mesh/point_cells.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/mesh/mesh.hpp"
#include "qjulia/mesh/shape.hpp"
#include "shapes.hpp"
#include "temporary_folder.hpp"

using namespace qjulia;
using Catch::Matchers::ContainsSubstring;

namespace {

const test::TemporaryFolder cloud_folder;

struct Cloud {
  std::vector<Eigen::Vector3d> points, normals;
};

Cloud cloud_of(const TriangleMesh& mesh, std::size_t count) {
  Cloud cloud;
  for (const auto& [position, normal] : sample_surface(mesh, count, 1)) {
    cloud.points.push_back(position);
    cloud.normals.push_back(normal);
  }
  return cloud;
}

shape::ConeSum cones(const TriangleMesh& mesh) {
  shape::ConeSum sum;
  for (const auto& [a, b, c] : mesh.triangles) {
    sum += shape::ConeSum(mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]);
  }
  return sum;
}

std::string cloud_ply(const Cloud& cloud) {
  std::string text = fmt::format(
      "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty "
      "float z\nproperty float nx\nproperty float ny\nproperty float nz\nend_header\n",
      cloud.points.size());
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    const auto& x = cloud.points[i];
    const auto& n = cloud.normals[i];
    text += fmt::format("{} {} {} {} {} {}\n", x.x(), x.y(), x.z(), n.x(), n.y(), n.z());
  }
  return text;
}

}  // namespace

TEST_CASE("cells of random points have the area and the volume of their surface") {
  const TriangleMesh mesh =
      GENERATE(shapes::sphere(4), shapes::torus(1, 0.35, 96, 48), shapes::box());
  const Cloud cloud = cloud_of(mesh, 5000);
  const TriangleMesh cells = shape::point_cells(cloud.points, cloud.normals, {});
  const shape::ConeSum of_mesh = cones(mesh), of_cells = cones(cells);
  CHECK(of_cells.area == Catch::Approx(of_mesh.area).epsilon(0.02));
  CHECK(of_cells.volume == Catch::Approx(of_mesh.volume).epsilon(0.01));
}

TEST_CASE("points that are doubled and moved a little do not double the area") {
  Cloud cloud = cloud_of(shapes::sphere(4), 3000);
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0, 0.01);
  const std::size_t count = cloud.points.size();
  for (std::size_t i = 0; i < count; ++i) {
    cloud.points.emplace_back(cloud.points[i] * (1 + noise(random)) +
                              1e-4 * Eigen::Vector3d(noise(random), noise(random), noise(random)));
    cloud.normals.push_back(cloud.normals[i]);
  }
  const double area = cones(shape::point_cells(cloud.points, cloud.normals, {})).area;
  CHECK(area == Catch::Approx(4 * std::numbers::pi).epsilon(0.05));
}

TEST_CASE("both sides of a thin plate keep their area") {
  TriangleMesh plate = shapes::box();
  for (auto& x : plate.vertices) x.z() *= 1e-3;
  const Cloud cloud = cloud_of(plate, 5000);
  const shape::ConeSum sum = cones(shape::point_cells(cloud.points, cloud.normals, {}));
  CHECK(sum.area == Catch::Approx(cones(plate).area).epsilon(0.1));
}

TEST_CASE("a point far from all others has a small cell") {
  Cloud cloud = cloud_of(shapes::sphere(4), 3000);
  const double area = cones(shape::point_cells(cloud.points, cloud.normals, {})).area;
  cloud.points.emplace_back(4, 0, 0);
  cloud.normals.emplace_back(1, 0, 0);
  const double more = cones(shape::point_cells(cloud.points, cloud.normals, {})).area - area;
  CHECK(more > 0);
  CHECK(more < 0.01 * area);
}

TEST_CASE("ply: points with normals are read as a surface") {
  const Cloud cloud = cloud_of(shapes::sphere(4), 2000);
  const auto path = cloud_folder.file("cloud.ply", cloud_ply(cloud));
  const auto [mesh, report] = read_and_inspect_mesh(path);
  CHECK(report.points == 2000);
  CHECK(report.components == 2000);
  CHECK(cones(mesh).volume == Catch::Approx(4 * std::numbers::pi / 3).epsilon(0.01));
  REQUIRE(report.warnings().size() == 1);
  CHECK_THAT(report.warnings()[0], ContainsSubstring("2000 points"));

  Cloud doubled = cloud;
  doubled.points.push_back(cloud.points[7]);
  doubled.normals.push_back(cloud.normals[7]);
  const auto again = read_and_inspect_mesh(cloud_folder.file("doubled.ply", cloud_ply(doubled)));
  CHECK(again.report.points == 2000);
  CHECK(again.report.welded_vertices == 1);

  // Normals that point inward, all of them, are turned where the inside is asked for.
  Cloud inward = cloud;
  for (auto& n : inward.normals) n = -n;
  const TriangleMesh turned = read_mesh(cloud_folder.file("inward.ply", cloud_ply(inward)));
  CHECK(signed_volume(turned) < 0);
  CHECK(signed_volume(oriented_outward(turned)) > 0);
}

TEST_CASE("ply: points that are no surface are refused") {
  const auto check_points_refused = [](const char* name, const Cloud& cloud, const char* why) {
    const auto path = cloud_folder.file(name, cloud_ply(cloud));
    CHECK_THROWS_AS(read_mesh(path), InputError);
    CHECK_THROWS_WITH(read_mesh(path), ContainsSubstring(name) && ContainsSubstring(why));
  };
  Cloud cloud = cloud_of(shapes::sphere(2), 100);
  cloud.normals[42] = Eigen::Vector3d::Zero();
  check_points_refused("zero.ply", cloud, "point 42 has the normal (0, 0, 0)");
  cloud.normals[42] = Eigen::Vector3d::Constant(std::nan(""));
  check_points_refused("nan.ply", cloud, "point 42");
  check_points_refused("few.ply", {{{0, 0, 0}, {1, 0, 0}, {0, 0, 0}}, {3, {0, 0, 1}}},
                       "only 2 different points");
  std::string bare = cloud_ply(cloud);
  for (const char* name : {"property float nx\n", "property float ny\n", "property float nz\n"}) {
    bare.erase(bare.find(name), 18);
  }
  CHECK_THROWS_WITH(read_mesh(cloud_folder.file("bare.ply", bare)),
                    ContainsSubstring("normals (nx, ny, nz)") && ContainsSubstring("MeshLab"));
}
