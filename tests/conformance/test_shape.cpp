#include <Eigen/Geometry>
#include <catch2/catch_all.hpp>
#include <limits>
#include <stop_token>

#include "base/larger_error.hpp"
#include "obj_text.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/exact/exact_map.hpp"
#include "qjulia/fit/fit.hpp"
#include "qjulia/mesh/radial_spread.hpp"
#include "qjulia/mesh/shape.hpp"
#include "shapes.hpp"
#include "temporary_folder.hpp"
#include "test_device.hpp"

using namespace qjulia;
using Catch::Matchers::ContainsSubstring;

namespace {

DeepestPoint deepest(const TriangleMesh& mesh) {
  return deepest_interior_point(SignedDistance(test::shared_device(), mesh), mesh.box());
}

}  // namespace

TEST_CASE("signed distance of a fine sphere is the distance to the centre less the radius") {
  const SignedDistance distance(test::shared_device(), shapes::sphere(6, 2));
  std::vector<Eigen::Vector3d> points;
  for (int i = -20; i <= 20; ++i) {
    for (int j = -20; j <= 20; ++j) points.emplace_back(0.2 * i, 0.2 * j, 0.1 * (i - j));
  }
  const auto distances = distance.at(points);
  double worst = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    worst = base::larger_error(worst, std::abs(distances[i] - (points[i].norm() - 2)));
  }
  CHECK(worst < 1e-3);
}

TEST_CASE("signed distance far away, nowhere and of nothing") {
  const SignedDistance distance(test::shared_device(), shapes::box());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  const std::vector<Eigen::Vector3d> points = {
      {1e6, 0, 0}, {0, nan, 0}, {0, 0, -infinity}, {0, 0, 0}, {0, 0, 1.5}};
  const auto distances = distance.at(points);
  CHECK(distances[0] == Catch::Approx(1e6 - 1));
  CHECK(distances[1] == infinity);
  CHECK(distances[2] == infinity);
  CHECK(distances[3] == Catch::Approx(-1));
  CHECK(distances[4] == Catch::Approx(0.5));
  CHECK(distance.at({}).empty());
  CHECK_THROWS_AS(SignedDistance(test::shared_device(), {}), InputError);
  CHECK_THROWS_AS(SignedDistance(test::shared_device(), {{{0, 0, 0}, {1, 1, 1}}, {}}), InputError);
}

TEST_CASE("signed distances repeat and do not depend on the order of the points") {
  const SignedDistance distance(test::shared_device(), shapes::torus());
  std::vector<Eigen::Vector3d> points;
  std::mt19937 random(2);
  for (int i = 0; i < 3000; ++i) {
    const double x = shapes::centred(random);
    points.emplace_back(1.5 * x, 1.5 * shapes::centred(random), 0.5 * shapes::centred(random));
  }
  const auto once = distance.at(points);
  CHECK(distance.at(points) == once);
  std::ranges::reverse(points);
  auto reversed = distance.at(points);
  std::ranges::reverse(reversed);
  CHECK(reversed == once);
}

TEST_CASE("the deepest point of simple shapes") {
  const auto sphere = deepest(shapes::moved(shapes::sphere(4), 10, {100, 200, -50}));
  CHECK(sphere.inradius == Catch::Approx(10).epsilon(5e-3));
  CHECK((sphere.position - Eigen::Vector3d(100, 200, -50)).norm() < 0.2);

  // Every point of the middle square of a plate is as deep: the middle is taken.
  const auto plate = deepest(shapes::box({0, 0, 0}, {3, 3, 0.2}));
  CHECK(plate.inradius == Catch::Approx(0.1).margin(3e-3));
  CHECK((plate.position - Eigen::Vector3d(1.5, 1.5, 0.1)).norm() < 0.1);

  const auto torus = deepest(shapes::torus(1, 0.35, 128, 64));
  CHECK(torus.inradius == Catch::Approx(0.35).margin(3e-3));
  CHECK(torus.position.head<2>().norm() == Catch::Approx(1).margin(0.05));

  const auto two =
      deepest(shapes::joined(shapes::sphere(3), shapes::moved(shapes::sphere(3), 1.5, {4, 0, 0})));
  CHECK((two.position - Eigen::Vector3d(4, 0, 0)).norm() < 0.1);
}

TEST_CASE("the deepest point of thin shapes") {
  const double thickness = GENERATE(1e-2, 1e-3, 2e-4);
  CAPTURE(thickness);
  const auto plate = deepest(shapes::box({0, 0, 0}, {1, 0.7, thickness}));
  CHECK(plate.inradius > 0.8 * thickness / 2);
  CHECK(plate.inradius < 1.001 * thickness / 2);
  const auto tube = deepest(shapes::torus(1, thickness, 128, 16));
  CHECK(tube.inradius > 0.7 * thickness);
  CHECK(tube.inradius < 1.001 * thickness);
}

TEST_CASE("the deepest point of damaged shapes") {
  for (const auto& mesh :
       {shapes::inside_out(shapes::sphere(3)), shapes::soup(shapes::sphere(3), 0.01),
        shapes::with_holes(shapes::sphere(3), 10)}) {
    const auto point = deepest(mesh);
    CHECK(point.inradius > 0.95);
    CHECK(point.position.norm() < 0.1);
  }
  CHECK(deepest(shapes::open_box()).inradius > 0.9);
}

TEST_CASE("a flat mesh makes no shape") {
  const TriangleMesh flat{{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 3}}};
  CHECK_THROWS_AS(make_shape(test::shared_device(), flat), InputError);
  TriangleMesh sheet = shapes::sphere(4);
  for (auto& x : sheet.vertices) x.z() = 0;
  CHECK_THROWS_AS(make_shape(test::shared_device(), sheet), InputError);
}

TEST_CASE("a mesh beyond the sizes that can be computed with makes no shape") {
  for (const double size : {1e15, 1e-15}) {
    CHECK_THROWS_WITH(make_shape(test::shared_device(), shapes::sphere(2, size)),
                      ContainsSubstring("cannot be fitted"));
  }
  const double expected = make_shape(test::shared_device(), shapes::sphere(3)).inradius;
  for (const double size : {5e11, 1e-12}) {
    CHECK(make_shape(test::shared_device(), shapes::sphere(3, size)).inradius ==
          Catch::Approx(expected).epsilon(1e-3));
  }
}

TEST_CASE("a stop request ends the preparation of a shape") {
  std::stop_source source;
  source.request_stop();
  const auto stop = source.get_token();
  const TriangleMesh mesh = shapes::sphere(5);
  CHECK_THROWS_AS(SignedDistance(test::shared_device(), mesh, Precision::single, stop),
                  Interrupted);
  CHECK_THROWS_AS(outer_surface(test::shared_device(), mesh, stop), Interrupted);
  const SignedDistance distance(test::shared_device(), mesh);
  CHECK_THROWS_AS(deepest_interior_point(distance, mesh.box(), stop), Interrupted);
  CHECK_THROWS_AS(make_shape(test::shared_device(), mesh, stop), Interrupted);
  // Parts that are hidden are looked for in blocks, with a look at the request before each.
  const TriangleMesh two = shapes::joined(shapes::sphere(2), shapes::sphere(2, 0.5));
  CHECK_THROWS_AS(outer_surface(test::shared_device(), two, stop), Interrupted);
}

TEST_CASE("repeated triangles do not change the inside once they are read") {
  const test::TemporaryFolder folder;
  TriangleMesh mesh = shapes::sphere(2);
  const std::vector<Triangle> once = mesh.triangles;
  for (int i = 1; i < 312; ++i) {
    mesh.triangles.insert(mesh.triangles.end(), once.begin(), once.end());
  }
  const auto path = folder.file("repeated.obj", test::obj_text(mesh));
  const SignedDistance distance(test::shared_device(), read_mesh(path));
  const std::vector<Eigen::Vector3d> points = {{0, 0, 0}, {0.5, 0.3, 0.2}, {1.5, 0, 0}};
  const auto windings = distance.winding_numbers(points);
  CHECK(windings[0] == Catch::Approx(1).margin(0.05));
  CHECK(windings[1] == Catch::Approx(1).margin(0.05));
  CHECK(windings[2] == Catch::Approx(0).margin(0.05));
  CHECK(SignedDistance(test::shared_device(), mesh).winding_numbers(points)[0] > 300);
}

TEST_CASE("a shape has longest side 3 and its deepest point at the origin") {
  const TriangleMesh mesh = shapes::moved(
      shapes::joined(shapes::sphere(4), shapes::moved(shapes::sphere(2), 0.3, {1.4, 0, 0})), 20,
      {7, 0, -300});
  const Shape shape = make_shape(test::shared_device(), shapes::inside_out(mesh));
  CHECK(shape.mesh.box().size().maxCoeff() == Catch::Approx(3));
  CHECK(shape.box.low == mesh.box().low);
  CHECK(shape.box.high == mesh.box().high);
  CHECK(signed_volume(shape.mesh) > 0);
  for (const std::size_t v : {0U, 17U, 400U}) {
    CHECK((shape.shape_to_map.to_map(mesh.vertices[v]) - shape.mesh.vertices[v]).norm() < 1e-9);
  }
  CHECK((shape.shape_to_map.to_shape({0, 0, 0}) - Eigen::Vector3d(7, 0, -300)).norm() < 0.5);
  const double at_origin = SignedDistance(test::shared_device(), shape.mesh)
                               .at(std::vector{Eigen::Vector3d(0, 0, 0)})[0];
  CHECK(shape.inradius == Catch::Approx(-at_origin).epsilon(1e-4));
  CHECK(shape.inradius == Catch::Approx(20 * shape.shape_to_map.scale).epsilon(0.01));
}

TEST_CASE("the detail that suits a shape is measured from its deepest point, wherever it lies") {
  const Device& device = test::shared_device();
  // No point of a torus's interior is near the middle of its box.
  const TriangleMesh mesh = shapes::torus(1, 0.3);
  const RadialSpread spread = radial_spread(mesh, deepest(mesh).position);
  for (const auto& moved : {mesh, shapes::moved(mesh, 4000, {90, -5000, 20})}) {
    ExactMapOptions exact;
    exact.resolution = 64;
    CHECK(exact_map(device, moved, exact).frame.detail.value() ==
          Catch::Approx(chosen_detail(DetailWord::automatic, spread, kExactRule)).epsilon(0.05));
    FitOptions options;
    options.factors = 24;
    options.schedule = "fast";
    options.max_evaluations = 60;
    CHECK(fit(device, moved, options).map.frame.detail.value() ==
          Catch::Approx(chosen_detail(DetailWord::automatic, spread, kFittedRule)).epsilon(0.05));
  }
}

namespace {

double area(const TriangleMesh& mesh) {
  double sum = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Eigen::Vector3d& origin = mesh.vertices[a];
    sum += 0.5 * (mesh.vertices[b] - origin).cross(mesh.vertices[c] - origin).norm();
  }
  return sum;
}

}  // namespace

TEST_CASE("what bodies hide of one another is left out of the outer surface") {
  const auto small = shapes::moved(shapes::sphere(3), 0.5, Eigen::Vector3d::Zero());
  const auto nested =
      outer_surface(test::shared_device(), shapes::joined(shapes::sphere(3), small));
  REQUIRE(nested.leaves_out);
  CHECK(area(nested.mesh) == Catch::Approx(area(shapes::sphere(3))).epsilon(1e-12));

  // Two boxes of side 2 that share a unit cube at a corner: coarse triangles are cut.
  const auto corner =
      shapes::joined(shapes::box({-1, -1, -1}, {1, 1, 1}), shapes::box({0, 0, 0}, {2, 2, 2}));
  const auto joined = outer_surface(test::shared_device(), corner);
  REQUIRE(joined.leaves_out);
  CHECK(area(joined.mesh) == Catch::Approx(48 - 6).epsilon(0.02));
  const auto distances = joined.distance.at(std::vector<Eigen::Vector3d>{
      {0.5, 0.5, 0.5}, {0.9, 0.9, 0.9}, {-0.5, 0, 0}, {1.5, 1.5, -0.5}, {3, 1, 1}});
  CHECK(distances[0] == Catch::Approx(-std::sqrt(0.5)).margin(0.05));
  CHECK(distances[1] == Catch::Approx(-std::sqrt(0.82)).margin(0.05));
  CHECK(distances[2] == Catch::Approx(-0.5).margin(0.01));
  CHECK(distances[3] == Catch::Approx(0.5).margin(0.01));
  CHECK(distances[4] == Catch::Approx(1).margin(0.01));

  // An inside-out box that sticks out of the one it is taken from.
  const auto tunnel = outer_surface(
      test::shared_device(),
      shapes::joined(shapes::box({-1, -1, -1}, {1, 1, 1}),
                     shapes::inside_out(shapes::box({-0.5, -0.5, -1.2}, {0.5, 0.5, 1.2}))));
  REQUIRE(tunnel.leaves_out);
  CHECK(tunnel.mesh.box().high.z() == Catch::Approx(1).margin(0.08));
}

TEST_CASE("a body that is inside out beside another has an inside") {
  for (const double size : {0.5, 1.0, 1.5}) {
    CAPTURE(size);
    const TriangleMesh other = shapes::moved(shapes::sphere(3), size, {4, 0, 0});
    const TriangleMesh right = shapes::joined(shapes::sphere(3), other);
    const TriangleMesh wrong = shapes::joined(shapes::sphere(3), shapes::inside_out(other));
    const std::vector<Eigen::Vector3d> centers{{0, 0, 0}, {4, 0, 0}};
    for (const double winding :
         SignedDistance(test::shared_device(), wrong).winding_numbers(centers)) {
      CHECK(winding == Catch::Approx(1).margin(0.05));
    }
    CHECK_FALSE(outer_surface(test::shared_device(), wrong).leaves_out);
    const Shape shape = make_shape(test::shared_device(), wrong);
    const Shape expected = make_shape(test::shared_device(), right);
    CHECK(shape.inradius == Catch::Approx(expected.inradius).epsilon(1e-9));
    CHECK(shape.mesh.triangles == expected.mesh.triangles);
  }
}

TEST_CASE("meshes that hide nothing are their own outer surface") {
  const auto hollow = shapes::joined(shapes::sphere(3), shapes::inside_out(shapes::sphere(3, 0.7)));
  for (const auto& mesh : {shapes::sphere(3), shapes::inside_out(shapes::torus()),
                           shapes::open_box(), shapes::soup(shapes::torus(), 0.01), hollow}) {
    CHECK_FALSE(outer_surface(test::shared_device(), mesh).leaves_out);
  }
}
