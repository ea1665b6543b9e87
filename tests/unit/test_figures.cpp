// Figures of surfaces that are known, and meshes written piece by piece.

#include <algorithm>
#include <catch2/catch_all.hpp>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>
#include <stop_token>

#include "edge_count.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/surface/figures.hpp"
#include "qjulia/surface/surface_file.hpp"
#include "shapes.hpp"
#include "temporary_folder.hpp"

using namespace qjulia;

namespace {

TriangleMesh two_spheres() {
  return shapes::joined(shapes::sphere(3), shapes::moved(shapes::sphere(2, 0.2), 1, {3, 0, 0}));
}

/// Outward normals of a sphere about the origin.
std::vector<Eigen::Vector3d> radial(const TriangleMesh& mesh) {
  std::vector<Eigen::Vector3d> normals;
  for (const auto& v : mesh.vertices) normals.push_back(v.normalized());
  return normals;
}

}  // namespace

TEST_CASE("area, volume and components of two spheres") {
  const SurfaceFigures figures = measure(two_spheres());
  CHECK(figures.components == 2);
  CHECK(figures.area == Catch::Approx(test::surface_area(two_spheres())).epsilon(1e-5));
  CHECK(figures.volume == Catch::Approx(test::enclosed_volume(two_spheres())).epsilon(1e-5));
  const TriangleMesh far = shapes::moved(shapes::box(), 1, {1e4, 0, 0});
  CHECK(measure(far).volume == Catch::Approx(8).epsilon(1e-3));
  CHECK(to_json(figures)["area_per_volume"].get<double>() ==
        Catch::Approx(figures.area / figures.volume));
}

TEST_CASE("figures do not depend on the pieces a mesh comes in") {
  const TriangleMesh mesh = two_spheres();
  const auto normals = radial(mesh);
  const SurfaceFigures whole = measure(mesh);
  FigureSink sink;
  // Triangles first, then vertices by sevens.
  sink.triangles(mesh.triangles);
  for (std::size_t i = 0; i < mesh.vertices.size(); i += 7) {
    const std::size_t count = std::min<std::size_t>(7, mesh.vertices.size() - i);
    sink.vertices(std::span(mesh.vertices).subspan(i, count), std::span(normals).subspan(i, count));
  }
  CHECK(sink.figures().area == Catch::Approx(whole.area).epsilon(1e-9));
  CHECK(sink.figures().volume == Catch::Approx(whole.volume).epsilon(1e-9));
  CHECK(sink.figures().components == 2);
}

TEST_CASE("box dimensions of sets that have one") {
  std::mt19937 random(2);
  std::uniform_real_distribution<float> uniform(0, 1);
  std::vector<Eigen::Vector3f> line;
  std::vector<Eigen::Vector3f> square;
  std::vector<Eigen::Vector3f> dust;  // Sierpinski's tetrahedron: ln 4 / ln 2 = 2; its face: 1.585
  Eigen::Vector3f at(0.1F, 0.1F, 0);
  const std::array<Eigen::Vector3f, 3> corners{Eigen::Vector3f{0, 0, 0}, Eigen::Vector3f{1, 0, 0},
                                               Eigen::Vector3f{0, 1, 0}};
  for (int i = 0; i < 2000000; ++i) {
    line.emplace_back(uniform(random), 0.3F, 0.2F);
    square.emplace_back(uniform(random), uniform(random), 0.2F);
    at = 0.5F * (at + corners[random() % 3]);
    dust.push_back(at);
  }
  const BoxDimension one = box_dimension(line, 1.0 / 600);
  CHECK(one.sizes == 7);
  CHECK(one.dimension == Catch::Approx(1).epsilon(0.01));
  CHECK(one.error < 0.01);
  CHECK(box_dimension(square, 1.0 / 300).dimension == Catch::Approx(2).epsilon(0.01));
  const BoxDimension sierpinski = box_dimension(dust, 1.0 / 600);
  CHECK(sierpinski.dimension == Catch::Approx(std::log(3) / std::log(2)).epsilon(0.04));
  CHECK(sierpinski.error < 0.05);
  CHECK(box_dimension(line, 0.2).sizes < 3);
  CHECK(std::isnan(box_dimension(line, 0.2).dimension));
  CHECK(box_dimension({}, 0.1).sizes == 0);
}

TEST_CASE("figures do not depend on where a mesh is") {
  for (const int subdivisions : {2, 5}) {
    const TriangleMesh here = shapes::sphere(subdivisions);
    TriangleMesh far = here;
    for (auto& x : far.vertices) x += Eigen::Vector3d(3e6, -2e6, 1e6);
    const SurfaceFigures wanted = measure(here), figures = measure(far);
    CHECK(figures.area == Catch::Approx(wanted.area).epsilon(1e-6));
    CHECK(figures.volume == Catch::Approx(wanted.volume).epsilon(1e-6));
    CHECK(figures.dimension == Catch::Approx(wanted.dimension).margin(0.02));
  }
}

TEST_CASE("smooth surfaces have dimension two, fine or coarse") {
  CHECK(measure(shapes::sphere(6)).dimension == Catch::Approx(2).margin(0.06));
  const SurfaceFigures box = measure(shapes::box());
  // Edges of a cube are in boxes of two sides: few large boxes, in proportion.
  CHECK(box.dimension == Catch::Approx(2).margin(0.12));
  CHECK(box.dimension_error < 0.05);
}

TEST_CASE("small components are left out") {
  const TriangleMesh mesh = two_spheres();
  const TriangleMesh largest = large_components(mesh, 1);
  CHECK((largest.vertices == shapes::sphere(3).vertices));
  CHECK((largest.triangles == shapes::sphere(3).triangles));
  // The small sphere has a 25th of the area.
  CHECK(inspect(large_components(mesh, 0.03)).components == 2);
  CHECK(inspect(large_components(mesh, 0.05)).components == 1);
}

TEST_CASE("flakes and bubbles are dropped, and bodies of a hundredth of the largest are not") {
  const double ball = signed_volume(shapes::sphere(3));
  TriangleMesh bubble = shapes::sphere(2, 0.2);
  for (auto& [a, b, c] : bubble.triangles) std::swap(b, c);
  TriangleMesh mesh = shapes::joined(shapes::moved(shapes::sphere(3), 0.25, {9, 0, 0}),
                                     shapes::moved(shapes::sphere(3), 0.2, {5, 0, 0}));
  mesh = shapes::joined(shapes::joined(mesh, shapes::sphere(3)), bubble);
  const double far = 1e4;
  for (auto& v : mesh.vertices) v.x() += far;
  const LoosePieces dropped = drop_loose_pieces(mesh);
  CHECK(dropped.count == 2);
  CHECK(dropped.volume == Catch::Approx(0.008 * ball - signed_volume(bubble)).epsilon(1e-6));
  CHECK(inspect(mesh).components == 2);
  CHECK(signed_volume(mesh) == Catch::Approx((1 + 1.0 / 64) * ball).epsilon(1e-6));
  CHECK(drop_loose_pieces(mesh).count == 0);
  TriangleMesh none;
  CHECK(drop_loose_pieces(none).count == 0);
}

TEST_CASE("pieces that a box has cut open are not judged by their volume") {
  TriangleMesh sheet;
  sheet.vertices = {{-3, -1, 0}, {-2, -1, 0}, {-2, 1, 0}, {-3, 1, 0}};
  sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
  TriangleMesh mesh = shapes::joined(sheet, shapes::sphere(3));
  mesh = shapes::joined(mesh, shapes::moved(shapes::sphere(3), 0.2, {5, 0, 0}));
  CHECK(drop_loose_pieces(mesh).count == 1);
  CHECK(inspect(mesh).components == 2);
  CHECK(mesh.box().low.x() == -3);
}

TEST_CASE("a triangle that has a vertex twice opens nothing") {
  TriangleMesh mesh =
      shapes::joined(shapes::sphere(3), shapes::moved(shapes::sphere(3), 0.2, {5, 0, 0}));
  const std::uint32_t last = mesh.triangles.back()[0];
  mesh.triangles.push_back({last, last, mesh.triangles.back()[1]});
  CHECK(drop_loose_pieces(mesh).count == 1);
}

TEST_CASE("an open piece far away does not make bodies small") {
  TriangleMesh sheet;
  sheet.vertices = {{100, -9, -9}, {100, 9, -9}, {100, 9, 9}, {100, -9, 9}};
  sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
  TriangleMesh mesh = shapes::joined(shapes::sphere(3), sheet);
  CHECK(drop_loose_pieces(mesh).count == 0);
  mesh = shapes::joined(shapes::moved(shapes::sphere(3), 0.2, {5, 0, 0}), mesh);
  CHECK(drop_loose_pieces(mesh).count == 1);
}

TEST_CASE("parts are known and dropped in whatever order their triangles come") {
  const TriangleMesh balls = shapes::joined(
      shapes::joined(shapes::sphere(3), shapes::moved(shapes::sphere(3), 0.2, {5, 0, 0})),
      shapes::moved(shapes::sphere(3), 0.5, {0, 5, 0}));
  TriangleMesh mesh = balls;
  std::shuffle(mesh.triangles.begin(), mesh.triangles.end(), std::mt19937(3));
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "kept.ply";
  PlyFile file(path);
  FigureSink sink(&file);
  sink.triangles(mesh.triangles);
  const std::vector<Eigen::Vector3d> normals(7, Eigen::Vector3d::UnitX());
  for (std::size_t i = 0; i < mesh.vertices.size(); i += 7) {
    const std::size_t count = std::min<std::size_t>(7, mesh.vertices.size() - i);
    sink.vertices(std::span(mesh.vertices).subspan(i, count), std::span(normals).first(count));
  }
  CHECK(sink.figures().components == 3);
  CHECK(sink.drop_loose_pieces().count == 1);
  file.commit([&](std::uint32_t vertex) { return sink.keeps(vertex); });

  TriangleMesh kept = mesh;
  // Blue tells the small ball, which is dropped.
  for (const auto& x : mesh.vertices) {
    kept.colors.push_back({1, static_cast<std::uint8_t>(x.y() > 2 ? 2 : 0),
                           static_cast<std::uint8_t>(x.x() > 2 ? 3 : 0)});
  }
  CHECK(drop_loose_pieces(kept).count == 1);
  REQUIRE(kept.colors.size() == kept.vertices.size());
  for (std::size_t v = 0; v < kept.vertices.size(); ++v) {
    const std::uint8_t green = kept.vertices[v].y() > 2 ? 2 : 0;
    REQUIRE(kept.colors[v] == VertexColor{1, green, 0});
  }
  const SurfaceFigures figures = sink.figures(), wanted = measure(kept);
  CHECK(figures.components == 2);
  CHECK(figures.vertices == kept.vertices.size());
  CHECK(figures.triangles == kept.triangles.size());
  CHECK(figures.area == Catch::Approx(wanted.area).epsilon(1e-9));
  CHECK(figures.volume == Catch::Approx(wanted.volume).epsilon(1e-9));
  CHECK(figures.volume == Catch::Approx(1.125 * signed_volume(shapes::sphere(3))).epsilon(1e-5));
  const TriangleMesh written = read_mesh(path);
  write_mesh(kept, path);
  CHECK((written.vertices == read_mesh(path).vertices));
  CHECK((written.triangles == read_mesh(path).triangles));
  CHECK_THROWS_AS(sink.drop_small_parts(1), InputError);
  CHECK_THROWS_AS(sink.triangles(mesh.triangles), InputError);
}

TEST_CASE("a mesh of long and thin triangles has few points to count") {
  TriangleMesh prism;
  constexpr std::uint32_t kSides = 20'000;
  prism.vertices = {{0, 0, -1}, {0, 0, 1}};
  for (std::uint32_t i = 0; i < kSides; ++i) {
    const double angle = 2 * std::numbers::pi * i / kSides;
    const std::uint32_t a = 2 + 2 * i, b = 2 + 2 * ((i + 1) % kSides);
    for (const double z : {-1, 1}) prism.vertices.emplace_back(std::cos(angle), std::sin(angle), z);
    for (const Triangle& t : {Triangle{a, b, b + 1}, Triangle{a, b + 1, a + 1}, Triangle{0, b, a},
                              Triangle{1, a + 1, b + 1}}) {
      prism.triangles.push_back(t);
    }
  }
  const SurfaceFigures figures = measure(prism);
  CHECK(figures.dimension == Catch::Approx(2).margin(0.1));
  CHECK(figures.volume == Catch::Approx(2 * std::numbers::pi).epsilon(1e-3));
}

TEST_CASE("a ply file written in pieces is the mesh") {
  const test::TemporaryFolder folder;
  const TriangleMesh mesh = shapes::sphere(2);
  const auto normals = radial(mesh);
  const auto path = folder.path() / "pieces.ply";
  {
    PlyFile file(path);
    file.triangles(mesh.triangles);
    file.vertices(std::span(mesh.vertices).first(5), std::span(normals).first(5));
    file.vertices(std::span(mesh.vertices).subspan(5), std::span(normals).subspan(5));
    CHECK(!std::filesystem::exists(path));
    file.commit();
  }
  CHECK(folder.names() == std::vector<std::string>{"pieces.ply"});
  const TriangleMesh back = read_mesh(path);
  write_mesh(mesh, path);
  const TriangleMesh same = read_mesh(path);
  CHECK((back.triangles == same.triangles));
  CHECK((back.vertices == same.vertices));
  std::filesystem::remove(path);
  {
    PlyFile file(path);
    file.vertices(mesh.vertices, normals);
  }
  CHECK(folder.names().empty());
}

TEST_CASE("a stop request ends the measuring of a mesh") {
  std::stop_source stopped;
  stopped.request_stop();
  CHECK_THROWS_AS(measure(shapes::sphere(2), stopped.get_token()), Interrupted);
}
