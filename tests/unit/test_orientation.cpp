// Parts of a mesh that are wound inside out are turned, and nothing else is.

#include <catch2/catch_all.hpp>
#include <numbers>
#include <stop_token>
#include <string>

#include "qjulia/base/error.hpp"
#include "qjulia/mesh/mesh.hpp"
#include "shapes.hpp"

using namespace qjulia;
using Catch::Matchers::ContainsSubstring;

namespace {

TriangleMesh ball(double radius, const Eigen::Vector3d& center = Eigen::Vector3d::Zero()) {
  return shapes::moved(shapes::sphere(3, radius), 1, center);
}

/// An ellipsoid whose axes differ, beside the origin.
TriangleMesh ellipsoid(double size, double x) {
  TriangleMesh mesh = shapes::sphere(3);
  for (auto& v : mesh.vertices) v = {size * v.x() + x, 0.7 * size * v.y(), 0.5 * size * v.z()};
  return mesh;
}

TriangleMesh ground() {
  return {{{-9, -9, -3}, {9, -9, -3}, {9, 9, -3}, {-9, 9, -3}}, {{0, 1, 2}, {0, 2, 3}}};
}

/// Checks that `given` is turned to `expected`, that `expected` stays as it is, and that reports
/// say so of both.
void check_turned(const TriangleMesh& given, const TriangleMesh& expected) {
  CHECK(oriented_outward(given).triangles == expected.triangles);
  CHECK(oriented_outward(expected).triangles == expected.triangles);
  const MeshReport report = inspect(given);
  const bool turns = given.triangles != expected.triangles;
  CHECK((report.turned_parts > 0) == turns);
  CHECK(inspect(expected).turned_parts == 0);
  std::string warnings;
  for (const std::string& warning : report.warnings()) warnings += warning + '\n';
  CHECK((warnings.find("inside out") != std::string::npos) == turns);
}

}  // namespace

TEST_CASE("a body that is inside out beside others is turned") {
  for (const double size : {0.1, 0.6, 1.0, 2.0}) {
    CAPTURE(size);
    const TriangleMesh one = ellipsoid(1, -2), other = ellipsoid(size, 2);
    const TriangleMesh both = shapes::joined(one, other);
    check_turned(both, both);
    check_turned(shapes::joined(one, shapes::inside_out(other)), both);
    check_turned(shapes::joined(shapes::inside_out(one), other), both);
    check_turned(shapes::inside_out(both), both);
  }
  const MeshReport report =
      inspect(shapes::joined(ellipsoid(1, -2), shapes::inside_out(ellipsoid(0.5, 2))));
  CHECK_FALSE(report.is_inside_out);
  CHECK(report.turned_parts == 1);
  CHECK_THAT(report.warnings().at(0),
             ContainsSubstring("parts of the mesh are inside out (1 of 2)"));
  CHECK(inspect(shapes::inside_out(ball(1))).is_inside_out);
}

TEST_CASE("cavities stay cavities, and are turned with the body about them") {
  const TriangleMesh shell = shapes::joined(ball(1), shapes::inside_out(ball(0.7)));
  check_turned(shell, shell);
  check_turned(shapes::inside_out(shell), shell);
  const TriangleMesh apart = shapes::moved(shell, 0.5, {3, 0, 0});
  check_turned(shapes::joined(shell, shapes::inside_out(apart)), shapes::joined(shell, apart));
}

TEST_CASE("a body in a cavity is a body, and one in a body stays as it is") {
  const TriangleMesh shell = shapes::joined(ball(1), shapes::inside_out(ball(0.7)));
  const TriangleMesh with_core = shapes::joined(shell, ball(0.4, {0.1, 0, 0}));
  check_turned(with_core, with_core);
  check_turned(shapes::inside_out(with_core), with_core);
  check_turned(shapes::joined(shell, shapes::inside_out(ball(0.4, {0.1, 0, 0}))), with_core);
  const TriangleMesh nested = shapes::joined(ball(1), ball(0.5));
  check_turned(nested, nested);
  check_turned(shapes::inside_out(nested), nested);
}

TEST_CASE("a part that is cut from another stays inside out where it sticks out of it") {
  const TriangleMesh tunnel =
      shapes::joined(shapes::box({-1, -1, -1}, {1, 1, 1}),
                     shapes::inside_out(shapes::box({-0.5, -0.5, -1.2}, {0.5, 0.5, 1.2})));
  check_turned(tunnel, tunnel);
  check_turned(shapes::inside_out(tunnel), tunnel);
  // A mirrored limb that reaches into the body is a limb.
  const TriangleMesh body = shapes::box({-1, -1, -1}, {1, 1, 1});
  const TriangleMesh limb = shapes::box({0.8, -0.3, -0.3}, {3, 0.3, 0.3});
  check_turned(shapes::joined(body, shapes::inside_out(limb)), shapes::joined(body, limb));
}

TEST_CASE("sheets neither turn bodies nor are turned with them") {
  const TriangleMesh scene = shapes::joined(ball(1), ground());
  check_turned(scene, scene);
  check_turned(shapes::joined(shapes::inside_out(ball(1)), ground()), scene);
  const TriangleMesh two = shapes::joined(scene, ball(0.5, {3, 0, 0}));
  check_turned(shapes::joined(scene, shapes::inside_out(ball(0.5, {3, 0, 0}))), two);
}

TEST_CASE("bodies with holes and soups are turned too") {
  const TriangleMesh one = shapes::with_holes(shapes::sphere(3), 7);
  const TriangleMesh other = shapes::moved(one, 0.5, {3, 0, 0});
  check_turned(shapes::joined(one, shapes::inside_out(other)), shapes::joined(one, other));
  // Pipes, whose walls are open tubes one in the other.
  const auto tube = [](double radius) {
    TriangleMesh mesh;
    constexpr unsigned kAround = 24;
    for (unsigned i = 0; i < kAround; ++i) {
      const double angle = 2 * std::numbers::pi * i / kAround;
      for (const double x : {-2.0, 2.0}) {
        mesh.vertices.emplace_back(x, radius * std::cos(angle), radius * std::sin(angle));
      }
      const unsigned a = 2 * i, b = 2 * ((i + 1) % kAround);
      mesh.triangles.push_back({a, b, b + 1});
      mesh.triangles.push_back({a, b + 1, a + 1});
    }
    return oriented_outward(mesh);
  };
  const TriangleMesh pipe = shapes::joined(tube(1), shapes::inside_out(tube(0.7)));
  check_turned(pipe, pipe);
  check_turned(shapes::inside_out(pipe), pipe);
  const TriangleMesh soup = shapes::soup(shapes::torus(), 0.01);
  check_turned(shapes::inside_out(soup), soup);
  const TriangleMesh with_body = shapes::joined(soup, ball(0.2, {3, 0, 0}));
  check_turned(shapes::joined(soup, shapes::inside_out(ball(0.2, {3, 0, 0}))), with_body);
}

TEST_CASE("parts that lie in others are found where rays meet edges and vertices of a grid") {
  // Cubes of a lattice, some of them touching, with a bubble in each and one that is inside out.
  TriangleMesh expected, given;
  for (int x = 0; x < 4; ++x) {
    for (int y = 0; y < 4; ++y) {
      const Eigen::Vector3d at(x, y, 0.25 * x);
      const TriangleMesh cube = shapes::box(at, at + Eigen::Vector3d(1, 1, 0.75));
      const Eigen::Vector3d corner = at + Eigen::Vector3d::Constant(0.25);
      const TriangleMesh bubble =
          shapes::inside_out(shapes::box(corner, corner + Eigen::Vector3d::Constant(0.25)));
      const TriangleMesh hollow = shapes::joined(cube, bubble);
      expected = shapes::joined(expected, hollow);
      given = shapes::joined(given, (x + y) % 3 == 1 ? shapes::inside_out(hollow) : hollow);
    }
  }
  check_turned(given, expected);
  CHECK(inspect(given).turned_parts == 2 * 5);
}

TEST_CASE("a stop request ends the search for parts that lie in others") {
  std::stop_source source;
  source.request_stop();
  const TriangleMesh mesh = shapes::joined(ball(1), shapes::inside_out(ball(0.5, {3, 0, 0})));
  CHECK_THROWS_AS(oriented_outward(mesh, source.get_token()), Interrupted);
}
