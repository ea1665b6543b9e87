// What is done to a mesh that was read, what is told of it, and what is measured.

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <catch2/catch_all.hpp>

#include "qjulia/base/error.hpp"
#include "qjulia/mesh/mesh.hpp"
#include "shapes.hpp"
#include "temporary_folder.hpp"

using namespace qjulia;
using Catch::Matchers::ContainsSubstring;

namespace {

const test::TemporaryFolder cleaned_folder;

InspectedMesh cleaned(const std::string& name, std::string_view bytes) {
  return read_and_inspect_mesh(cleaned_folder.file(name, bytes));
}

}  // namespace

TEST_CASE("nothing is lost where OpenMesh's own meshes would drop faces") {
  // Three triangles at one edge.
  const auto [fan, report] = cleaned(
      "fan.obj", "v 0 0 0\nv 0 0 1\nv 1 0 0\nv 0 1 0\nv -1 0 0\nf 1 2 3\nf 1 2 4\nf 1 2 5\n");
  CHECK(fan.triangles.size() == 3);
  CHECK(report.non_manifold_edges == 1);
  CHECK(report.open_edges == 6);
  CHECK(report.warnings().size() == 2);
}

TEST_CASE("equal vertices are welded and triangles without area dropped") {
  write_mesh(shapes::soup(shapes::box()), cleaned_folder.path() / "soup.obj");
  const auto [mesh, report] = read_and_inspect_mesh(cleaned_folder.path() / "soup.obj");
  CHECK(mesh.vertices.size() == 8);
  CHECK(report.welded_vertices == 28);
  CHECK(report.closed());
  // A vertex that only a dropped triangle uses goes with it, and -0 equals 0.
  const auto [left, found] = cleaned(
      "clean.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv -0 0 0\nv 9 9 9\nf 1 2 3\nf 4 1 2\nf 4 4 5\n");
  CHECK(left.vertices.size() == 3);
  CHECK(left.box().high == Eigen::Vector3d(1, 1, 0));
  CHECK(found.dropped_triangles == 2);
  CHECK(found.welded_vertices == 1);
}

TEST_CASE("vertices keep the file's order, and the report says what became of each") {
  // The second is used by nothing, the fifth equals the first, the sixth is only in a dropped one.
  const auto [mesh, report] = cleaned("order.obj",
                                      "v 0 0 0\nv 9 9 9\nv 1 0 0\nv 0 1 0\nv 0 0 0\nv 5 5 5\n"
                                      "v 0 0 1\nf 7 4 3\nf 3 5 7\nf 6 6 4\nf 4 7 1\nf 1 3 4\n");
  const std::vector<Eigen::Vector3d> left{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  CHECK(mesh.vertices == left);
  const std::vector<Triangle> triangles{{3, 2, 1}, {1, 0, 3}, {2, 3, 0}, {0, 1, 2}};
  CHECK(mesh.triangles == triangles);
  constexpr auto kNone = MeshReport::kNoVertex;
  CHECK(report.vertex_of_file == std::vector<std::uint32_t>{0, kNone, 1, 2, 0, kNone, 3});
  // Three corners for each triangle of an .stl file.
  write_mesh(mesh, cleaned_folder.path() / "order.stl");
  const auto [soup, found] = read_and_inspect_mesh(cleaned_folder.path() / "order.stl");
  CHECK(found.vertex_of_file.size() == 12);
  CHECK(found.welded_vertices == 0);
  for (std::size_t corner = 0; corner < 12; ++corner) {
    const std::uint32_t vertex = triangles[corner / 3][corner % 3];
    CHECK(soup.vertices[found.vertex_of_file[corner]] == mesh.vertices[vertex]);
  }
}

TEST_CASE("a mesh in memory can be treated as if it were read from a file") {
  TriangleMesh mesh = shapes::soup(shapes::torus(1, 0.45, 12, 8));
  for (Eigen::Vector3d& x : mesh.vertices) x = x / 3 + Eigen::Vector3d::Constant(0.1);
  mesh.triangles.push_back({0, 0, 1});
  mesh.triangles.push_back(mesh.triangles.front());
  std::string text;
  for (const auto& x : mesh.vertices) text += fmt::format("v {} {} {}\n", x.x(), x.y(), x.z());
  for (const auto& [a, b, c] : mesh.triangles) {
    text += fmt::format("f {} {} {}\n", a + 1, b + 1, c + 1);
  }
  const auto [file, of_file] = cleaned("memory.obj", text);
  const auto [memory, of_memory] = as_if_read(mesh);
  CHECK(memory.vertices == file.vertices);
  CHECK(memory.triangles == file.triangles);
  CHECK(memory.vertices.size() == 96);
  CHECK(of_memory.vertex_of_file == of_file.vertex_of_file);
  CHECK(of_memory.warnings() == of_file.warnings());
  CHECK(of_memory.welded_vertices == of_file.welded_vertices);
  CHECK_THROWS_AS(as_if_read({}), InputError);
  CHECK_THROWS_WITH(as_if_read({.vertices = {{0, 0, 0}, {1, 0, 0}}, .triangles = {{0, 1, 1}}}),
                    ContainsSubstring("has an area"));
  CHECK_THROWS_WITH(
      as_if_read({.vertices = {{0, 0, 0}, {1e13, 0, 0}, {0, 1, 0}}, .triangles = {{0, 1, 2}}}),
      ContainsSubstring("scale the mesh"));
}

TEST_CASE("concave polygons keep their area") {
  // A plus sign, extruded: its ends as polygons of twelve corners.
  const std::vector<Eigen::Vector2i> plus = {{1, 0}, {2, 0}, {2, 1}, {3, 1}, {3, 2}, {2, 2},
                                             {2, 3}, {1, 3}, {1, 2}, {0, 2}, {0, 1}, {1, 1}};
  std::string text;
  std::string top = "f";
  std::string bottom = "f";
  for (int z = 0; z < 2; ++z) {
    for (const auto& p : plus) text += fmt::format("v {} {} {}\n", p.x(), p.y(), z);
  }
  for (int i = 0; i < 12; ++i) {
    const int next = (i + 1) % 12;
    text += fmt::format("f {} {} {} {}\n", i + 1, next + 1, next + 13, i + 13);
    top += fmt::format(" {}", i + 13);
    bottom += fmt::format(" {}", 12 - i);
  }
  const auto [mesh, report] = cleaned("plus.obj", text + top + "\n" + bottom + "\n");
  CHECK(signed_volume(mesh) == Catch::Approx(5));
  CHECK(mesh.triangles.size() == 44);
  CHECK(report.closed());
  CHECK(report.warnings().empty());
  double area = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const auto& x = mesh.vertices;
    area += 0.5 * (x[b] - x[a]).cross(x[c] - x[a]).norm();
  }
  CHECK(area == Catch::Approx(22));
  const MeshReport bow =
      cleaned("bow.obj", "v 0 0 0\nv 2 2 0\nv 2 0 0\nv 0 1 0\nf 1 2 3 4\n").report;
  CHECK(bow.bad_polygons == 1);
  CHECK_THAT(bow.warnings().at(1), ContainsSubstring("1 polygons cross themselves"));
}

TEST_CASE("repeated triangles are dropped and counted") {
  const auto repeated = [](const TriangleMesh& mesh, std::size_t times) {
    TriangleMesh result = mesh;
    for (std::size_t i = 1; i < times; ++i) {
      for (Triangle triangle : mesh.triangles) {
        std::ranges::rotate(triangle, triangle.begin() + static_cast<std::ptrdiff_t>(i % 3));
        result.triangles.push_back(triangle);
      }
    }
    return result;
  };
  const TriangleMesh sphere = shapes::sphere(1);
  const auto read_back = [&](const TriangleMesh& mesh) {
    write_mesh(mesh, cleaned_folder.path() / "repeated.obj");
    return read_and_inspect_mesh(cleaned_folder.path() / "repeated.obj");
  };
  const TriangleMesh plain = read_back(sphere).mesh;
  const auto [mesh, report] = read_back(repeated(sphere, 312));
  CHECK(mesh.triangles == plain.triangles);
  CHECK(report.duplicate_triangles == 311 * sphere.triangles.size());
  CHECK(report.closed());
  CHECK_THAT(report.warnings().at(0), ContainsSubstring("repeat others"));

  // Each triangle from both sides: of each pair the first is left.
  const auto [two_sided, found] = read_back(shapes::joined(sphere, shapes::inside_out(sphere)));
  CHECK(two_sided.triangles == plain.triangles);
  CHECK(found.is_two_sided);
  CHECK(found.two_sided_triangles == sphere.triangles.size());
  CHECK_THAT(found.warnings().at(0), ContainsSubstring("both windings"));

  // A sheet beside a body: both its sides stay, so that they cancel out.
  TriangleMesh sheet;
  sheet.vertices = {{5, 0, 0}, {6, 0, 0}, {5, 1, 0}};
  sheet.triangles = {{0, 1, 2}, {0, 2, 1}, {1, 2, 0}};
  const auto [both, beside] = read_back(shapes::joined(sphere, sheet));
  CHECK(both.triangles.size() == sphere.triangles.size() + 2);
  CHECK(beside.two_sided_triangles == 1);
  CHECK(beside.duplicate_triangles == 1);
  CHECK_FALSE(beside.is_two_sided);
}

TEST_CASE("inspect counts components, edges and turned triangles") {
  const auto two = inspect(shapes::joined(shapes::box(), shapes::torus()));
  CHECK(two.components == 2);
  CHECK(two.closed());
  const auto open = inspect(shapes::open_box());
  CHECK(open.open_edges == 4);
  CHECK(open.warnings().size() == 1);
  CHECK(inspect(shapes::inside_out(shapes::sphere(1))).is_inside_out);
  CHECK(!inspect(shapes::sphere(1)).is_inside_out);
  TriangleMesh one_turned = shapes::box();
  std::swap(one_turned.triangles[0][0], one_turned.triangles[0][1]);
  CHECK(inspect(one_turned).non_manifold_edges == 3);
  CHECK(inspect(shapes::moved(shapes::box(), 1, {1e4, 0, 0})).warnings().size() == 1);
}

TEST_CASE("signed volume") {
  CHECK(signed_volume(shapes::box({1, 2, 3}, {2, 4, 6})) == Catch::Approx(6));
  CHECK(signed_volume(shapes::inside_out(shapes::box())) == Catch::Approx(-8));
  CHECK(signed_volume(shapes::moved(shapes::box(), 1, {1e8, 0, 0})) == Catch::Approx(8));
  CHECK(signed_volume(shapes::open_box()) > 0);
  // A ground below a box has no volume of its own, however high the box floats.
  for (const double height : {1.01, 3.0, 30.0}) {
    const TriangleMesh box = shapes::moved(shapes::box(), 1, {0, 0, height});
    TriangleMesh scene = box;
    const auto first = static_cast<std::uint32_t>(scene.vertices.size());
    for (const auto& [x, y] : {std::pair{-9, -9}, {9, -9}, {9, 9}, {-9, 9}}) {
      scene.vertices.emplace_back(x, y, 0);
    }
    scene.triangles.push_back({first, first + 1, first + 2});
    scene.triangles.push_back({first, first + 2, first + 3});
    CHECK(signed_volume(scene) == Catch::Approx(8));
  }
  CHECK(signed_volume(oriented_outward(shapes::inside_out(shapes::box()))) == Catch::Approx(8));
}
