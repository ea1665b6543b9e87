// Walls of shapes whose thickness is known at every point.

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <catch2/catch_all.hpp>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <random>
#include <stop_token>

#include "distance_reference.hpp"
#include "mesh/triangle_tree.hpp"
#include "print/walls.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/surface/figures.hpp"
#include "shapes.hpp"

using namespace qjulia;

namespace {

constexpr std::size_t kSamples = 400;

/// The least and the largest relative error of walls where `thickness(position)` is the truth.
struct Errors {
  double least = std::numeric_limits<double>::infinity();
  double largest = -std::numeric_limits<double>::infinity();
};
template <class Thickness>
Errors errors_of(const TriangleMesh& mesh, const Thickness& thickness) {
  Errors errors;
  for (const auto& [position, found] : surface::sample_walls(mesh, kSamples, 1)) {
    const double error = found / thickness(position) - 1;
    errors.least = std::min(errors.least, error);
    errors.largest = std::max(errors.largest, error);
  }
  return errors;
}

/// A constant as a function of the position.
auto everywhere(double thickness) {
  return [=](const Eigen::Vector3d&) { return thickness; };
}

TriangleMesh shell(int subdivisions, double inner, double outer) {
  return shapes::joined(shapes::sphere(subdivisions, outer),
                        shapes::inside_out(shapes::sphere(subdivisions, inner)));
}

/// A prism of `height` about the z axis over a regular polygon with corners at `radius`.
TriangleMesh prism(std::uint32_t sides, double radius, double height) {
  TriangleMesh mesh;
  for (const double z : {0.0, height}) {
    for (std::uint32_t i = 0; i < sides; ++i) {
      const double u = 2 * std::numbers::pi * i / sides;
      mesh.vertices.emplace_back(radius * std::cos(u), radius * std::sin(u), z);
    }
  }
  for (std::uint32_t i = 0; i < sides; ++i) {
    const std::uint32_t next = (i + 1) % sides;
    mesh.triangles.push_back({i, next, sides + next});
    mesh.triangles.push_back({i, sides + next, sides + i});
    if (i == 0 || next == 0) continue;
    mesh.triangles.push_back({0, next, i});
    mesh.triangles.push_back({sides, sides + i, sides + next});
  }
  return mesh;
}

/// Checks a convex polyhedron with planes in general position. A ball that touches the plane with
/// normal n at p stays below the plane with normal m, whose distance from p is d, as long as its
/// radius is at most d / (1 - n . m).
auto in_planes_of(const TriangleMesh& mesh) {
  return [&mesh](const Eigen::Vector3d& p) {
    const auto& x = mesh.vertices;
    const auto plane = [&](const Triangle& t) {
      const Eigen::Vector3d n = (x[t[1]] - x[t[0]]).cross(x[t[2]] - x[t[0]]).normalized();
      return std::pair(n, n.dot(x[t[0]] - p));
    };
    const auto own = *std::ranges::min_element(mesh.triangles, {},
                                               [&](const Triangle& t) { return plane(t).second; });
    const Eigen::Vector3d n = plane(own).first;
    double radius = std::numeric_limits<double>::infinity();
    for (const Triangle& t : mesh.triangles) {
      const auto [m, distance] = plane(t);
      if (n.dot(m) < 0.999) radius = std::min(radius, distance / (1 - n.dot(m)));
    }
    return 2 * radius;
  };
}

/// A cube of half side 1 with edges rounded by `radius`, `cells` along each side.
TriangleMesh rounded_cube(std::uint32_t cells, double radius) {
  TriangleMesh mesh;
  std::map<std::array<std::uint32_t, 3>, std::uint32_t> numbers;
  const auto vertex = [&](const std::array<std::uint32_t, 3>& at) {
    const auto [found, is_new] =
        numbers.try_emplace(at, static_cast<std::uint32_t>(mesh.vertices.size()));
    if (is_new) {
      const Eigen::Vector3d x =
          2 * Eigen::Vector3d(at[0], at[1], at[2]) / cells - Eigen::Vector3d::Ones();
      const Eigen::Vector3d inner = x.cwiseMax(radius - 1).cwiseMin(1 - radius);
      mesh.vertices.push_back(inner + radius * (x - inner).normalized());
    }
    return found->second;
  };
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::uint32_t i = 0; i < cells; ++i) {
      for (std::uint32_t j = 0; j < cells; ++j) {
        const auto corner = [&](std::uint32_t side, std::uint32_t di, std::uint32_t dj) {
          std::array<std::uint32_t, 3> at{};
          at[axis] = side;
          at[(axis + 1) % 3] = i + di;
          at[(axis + 2) % 3] = j + dj;
          return vertex(at);
        };
        mesh.triangles.push_back({corner(cells, 0, 0), corner(cells, 1, 0), corner(cells, 1, 1)});
        mesh.triangles.push_back({corner(cells, 0, 0), corner(cells, 1, 1), corner(cells, 0, 1)});
        mesh.triangles.push_back({corner(0, 0, 0), corner(0, 1, 1), corner(0, 1, 0)});
        mesh.triangles.push_back({corner(0, 0, 0), corner(0, 0, 1), corner(0, 1, 1)});
      }
    }
  }
  return mesh;
}

}  // namespace

TEST_CASE("the wall of a solid sphere is its diameter, and on a coarse one less") {
  for (const int subdivisions : {1, 2, 3, 4, 6}) {
    const TriangleMesh mesh = shapes::sphere(subdivisions);
    const Errors errors = errors_of(mesh, everywhere(2));
    double cut_off = 0;
    for (const auto& [a, b, c] : mesh.triangles) {
      const auto& x = mesh.vertices;
      cut_off = std::max(cut_off, 1 - (x[a] + x[b] + x[c]).norm() / 3);
    }
    const double angular_radius = std::sqrt(2 * cut_off);  // of a triangle, seen from the centre
    CAPTURE(subdivisions, angular_radius);
    CHECK(errors.largest < 0.002);
    // A ball about the centre is equally near to many triangles, and rounding chooses the one it
    // shrinks to: turned 1,000 times at random, the coarsest sphere has .55 here as median and .65
    // as the worst; four subdivisions, turned 100 times, have -.0113 at worst.
    CHECK(errors.least > -0.7 * angular_radius);
    if (subdivisions >= 4) CHECK(errors.least > -0.012);
  }
}

TEST_CASE("bumps much lower than a wall is thick make it little thinner") {
  TriangleMesh mesh = shapes::sphere(5);
  std::mt19937 random(5);
  for (auto& x : mesh.vertices) x *= 1 + 0.002 * shapes::centred(random);
  const WallThickness walls = wall_thickness(mesh);
  CHECK(walls.median < 2);
  CHECK(walls.median > 1.9);
  CHECK(walls.tenth > 1.7);
}

TEST_CASE("the wall of a hollow sphere is as thick as the shell, at any scale") {
  for (const int subdivisions : {3, 4, 5}) {
    for (const double scale : {1e-3, 1.0, 1e3}) {
      const Errors errors =
          errors_of(shell(subdivisions, 2 * scale, 2.1 * scale), everywhere(0.1 * scale));
      CAPTURE(subdivisions, scale);
      CHECK(errors.largest < 0.002);
      CHECK(errors.least > -0.01);
    }
  }
}

TEST_CASE("walls of slabs, wedges and other convex polyhedra are right near edges too") {
  const TriangleMesh slab = shapes::box({0, 0, 0}, {10, 10, 0.3});
  CHECK(wall_thickness(slab).median == Catch::Approx(0.3).epsilon(1e-3));
  for (const double scale : {1e-3, 1.0, 1e3}) {
    for (const TriangleMesh& shape : {slab, prism(3, 1, 6), prism(4, 1, 0.2), prism(6, 1, 1)}) {
      const TriangleMesh mesh = shapes::moved(shape, scale, Eigen::Vector3d::Zero());
      const Errors errors = errors_of(mesh, in_planes_of(mesh));
      CAPTURE(scale, mesh.triangles.size());
      CHECK(errors.largest < 0.01);
      CHECK(errors.least > -0.01);
    }
  }
}

TEST_CASE("a cylinder is as thick as the ball in it, although its sides are flat") {
  for (const std::uint32_t sides : {12U, 32U, 128U}) {
    // Triangles are as long as the cylinder. Within a radius of its ends, balls also touch the
    // ends.
    const double height = 8;
    const Errors errors = errors_of(prism(sides, 1, height), [&](const Eigen::Vector3d& p) {
      const double to_end = std::min(p.z(), height - p.z());
      return 2 * (to_end < 1e-9 ? 1 - p.head<2>().norm() : std::min(to_end, 1.0));
    });
    // Balls at the ends touch the flat sides, which are inside the round ones.
    CAPTURE(sides);
    CHECK(errors.largest < 0.01);
    CHECK(wall_thickness(prism(sides, 1, height)).median ==
          Catch::Approx(2 * std::cos(std::numbers::pi / sides)).epsilon(0.015));
  }
}

TEST_CASE("edges that are round have walls of twice their radius") {
  const double radius = 0.25;
  const Errors errors = errors_of(rounded_cube(96, radius), [&](const Eigen::Vector3d& p) {
    Eigen::Vector3d depth = Eigen::Vector3d::Ones() - p.cwiseAbs();
    std::ranges::sort(depth);
    // On a flat side the ball reaches to the nearest other side.
    return 2 * (depth[1] < radius ? radius : std::min(depth[1], 1.0));
  });
  // Where round and flat meet, the mesh's normals are off by a quarter of the 0.083 by which its
  // triangles turn there, and so are the balls.
  CHECK(errors.largest < 0.025);
  CHECK(errors.least > -0.01);
}

TEST_CASE("walls are as thick as the balls that fit between them") {
  // A fifth of the area is of a thin slab, the rest of a thick one.
  const TriangleMesh slabs =
      shapes::joined(shapes::box({0, 0, 0}, {10, 10, 0.5}), shapes::box({20, 0, 0}, {40, 20, 2}));
  const WallThickness walls = wall_thickness(slabs);
  CHECK(walls.tenth == Catch::Approx(0.5).epsilon(0.05));
  CHECK(walls.median == Catch::Approx(2).epsilon(0.01));
  // Balls that touch close to an edge are smaller.
  CHECK(walls.thinnest < 0.9 * walls.tenth);
  CHECK(wall_thickness(shapes::sphere(4)).median == Catch::Approx(2).epsilon(0.01));
}

TEST_CASE("walls of a mesh that is inside out are those of the mesh turned") {
  const TriangleMesh mesh = shapes::sphere(3);
  CHECK(wall_thickness(shapes::inside_out(mesh)).median ==
        Catch::Approx(wall_thickness(mesh).median).epsilon(1e-3));
}

TEST_CASE("a stop request ends the measuring of walls") {
  std::stop_source stopped;
  stopped.request_stop();
  CHECK_THROWS_AS(wall_thickness(shapes::sphere(3), stopped.get_token()), Interrupted);
}

TEST_CASE("nearest points of a tree of triangles are those found by going over all") {
  const TriangleMesh mesh = shapes::torus();
  const shape::TriangleTree tree(mesh);
  std::mt19937 random(3);
  for (int i = 0; i < 200; ++i) {
    const double x = 2 * shapes::centred(random), y = 2 * shapes::centred(random);
    const Eigen::Vector3d p(x, y, shapes::centred(random));
    const double wanted = reference::distance(mesh, p);
    const auto exact = tree.nearest(p);
    CHECK(exact.distance == Catch::Approx(wanted).epsilon(1e-9));
    CHECK((exact.position - p).norm() == Catch::Approx(wanted).epsilon(1e-9));
    const double loose = tree.nearest(p, 0.05).distance;
    CHECK(loose >= wanted * (1 - 1e-9));
    CHECK(loose <= wanted * 1.05);
  }
}

TEST_CASE("rays meet the first triangle on their way") {
  const shape::TriangleTree tree(shapes::box());
  const double infinity = std::numeric_limits<double>::infinity();
  const Eigen::Vector3d inside(0.1, 0.2, 0.3), along = Eigen::Vector3d::UnitX();
  CHECK(tree.first_hit(inside, along, 0) == Catch::Approx(0.9));
  CHECK(tree.first_hit(inside, -along, 0) == Catch::Approx(1.1));
  CHECK(tree.first_hit({-1, 0.2, 0.3}, along, 1e-9) == Catch::Approx(2));
  CHECK(tree.first_hit({3, 0.2, 0.3}, along, 0) == infinity);
  // Along the diagonal that two triangles of a side share.
  CHECK(tree.first_hit({0, 0.5, 0.5}, along, 0) == Catch::Approx(1));
}
