// Which way shapes stand: names, turns, and what a mesh's own form tells.

#include <Eigen/LU>
#include <array>
#include <catch2/catch_all.hpp>

#include "qjulia/mesh/mesh.hpp"
#include "shapes.hpp"
#include "temporary_folder.hpp"

using namespace qjulia;
using Eigen::Vector3d;

namespace {

constexpr std::array kAll{UpAxis::x,       UpAxis::y,       UpAxis::z,
                          UpAxis::minus_x, UpAxis::minus_y, UpAxis::minus_z};

TriangleMesh turned(TriangleMesh mesh, const Eigen::Matrix3d& turn) {
  for (Vector3d& x : mesh.vertices) x = turn * x;
  return mesh;
}

/// Feet, legs, a body, hands held out and a head, along y.
TriangleMesh figure() {
  TriangleMesh mesh = shapes::moved(shapes::sphere(3), 0.12, {0, 1.6, 0});
  for (const double side : {-1.0, 1.0}) {
    mesh = shapes::joined(
        mesh, shapes::box({side * 0.2 - 0.06, 0, -0.1}, {side * 0.2 + 0.06, 0.1, 0.15}));
    mesh = shapes::joined(
        mesh, shapes::box({side * 0.2 - 0.05, 0.1, -0.05}, {side * 0.2 + 0.05, 0.9, 0.05}));
    mesh = shapes::joined(mesh, shapes::moved(shapes::sphere(3), 0.06, {side * 0.8, 1.3, 0}));
  }
  return shapes::joined(mesh, shapes::moved(shapes::sphere(3), 0.2, {0, 1.1, 0}));
}

/// A round body on a round plate, along y.
TriangleMesh on_a_plate() {
  return shapes::joined(shapes::sphere(3), shapes::box({-0.7, -1.1, -0.7}, {0.7, -0.9, 0.7}));
}

}  // namespace

TEST_CASE("directions have names, and turns by right angles lead from one to any other") {
  for (const UpAxis from : kAll) {
    CHECK(up_axis_named(to_string(from)) == from);
    for (const UpAxis to : kAll) {
      const Eigen::Matrix3d turn = quarter_turns(from, to);
      CHECK((turn * direction(from) - direction(to)).norm() == 0);
      CHECK(turn.determinant() == 1);
      CHECK((turn * turn.transpose() - Eigen::Matrix3d::Identity()).norm() == 0);
      CHECK((turn.array() * (turn.array().square() - 1) == 0).all());
    }
  }
  for (const char* name : {"", "w", "Y", "+y", "--y", "auto"}) CHECK(!up_axis_named(name));
}

TEST_CASE("the flattest, widest end of a mesh is down, whichever way it lies") {
  for (const UpAxis up : kAll) {
    CAPTURE(to_string(up));
    const Eigen::Matrix3d turn = quarter_turns(UpAxis::y, up);
    CHECK(guess_up(turned(on_a_plate(), turn)) == up);
    CHECK(guess_up(shapes::inside_out(turned(on_a_plate(), turn))) == up);
    CHECK(guess_up(shapes::moved(turned(on_a_plate(), turn), 1e-4, {3, -5, 7})) == up);
    CHECK(guess_up(turned(figure(), turn)) == up);
  }
}

TEST_CASE("the format that a mesh was read from decides where its form does not") {
  const test::TemporaryFolder folder;
  for (const auto& [name, up] : {std::pair{"a.stl", UpAxis::z},
                                 {"a.3mf", UpAxis::z},
                                 {"a.glb", UpAxis::y},
                                 {"a.obj", kDefaultUp},
                                 {"a.ply", kDefaultUp},
                                 {"a.off", kDefaultUp}}) {
    CAPTURE(name);
    write_mesh(shapes::sphere(3), folder.path() / name);
    CHECK(guess_up(read_mesh(folder.path() / name)) == up);
    CHECK(format_up(name).value_or(kDefaultUp) == up);
    TriangleMesh lying = turned(on_a_plate(), quarter_turns(UpAxis::y, UpAxis::minus_x));
    lying.format_up = format_up(name);
    CHECK(guess_up(lying) == UpAxis::minus_x);
  }
}

TEST_CASE("a mesh without an end to stand on has y up") {
  CHECK(guess_up(shapes::sphere(4)) == UpAxis::y);
  CHECK(guess_up(shapes::box({0, 0, 0}, {1, 2, 3})) == UpAxis::y);
  CHECK(guess_up(shapes::box({0, 0, 0}, {1, 1, 0})) == UpAxis::y);
}
