// Meshes made ready for printers.

#include <Eigen/Geometry>
#include <algorithm>
#include <catch2/catch_all.hpp>
#include <cmath>
#include <functional>
#include <numbers>
#include <set>
#include <string>

#include "mesh/triangle_tree.hpp"
#include "original/original_file.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/surface/print.hpp"
#include "shapes.hpp"

using namespace qjulia;

namespace {

void check_solid(const TriangleMesh& mesh) {
  const MeshReport report = inspect(mesh);
  CHECK(report.open_edges == 0);
  CHECK(report.non_manifold_edges == 0);
  CHECK(report.components == 1);
  CHECK(mesh.normals.size() == mesh.vertices.size());
}

/// The surface where `distance` is 0, in a cube about the origin.
TriangleMesh solid_of(int samples, double side,
                      const std::function<double(const Eigen::Vector3d&)>& distance) {
  original::SampledDistance field;
  field.samples = {samples, samples, samples};
  field.lengths = Eigen::Vector3d::Constant(side);
  const auto at = [&](int i) { return side * ((i + 0.5) / samples - 0.5); };
  for (int k = 0; k < samples; ++k) {
    for (int j = 0; j < samples; ++j) {
      for (int i = 0; i < samples; ++i) {
        field.values.push_back(static_cast<float>(distance({at(i), at(j), at(k)})));
      }
    }
  }
  return original::mesh_of(field);
}

/// A ball of radius 3 about the origin with a thin plate through its middle, 12 wide.
TriangleMesh ball_with_plate(double thickness) {
  return solid_of(140, 14, [&](const Eigen::Vector3d& p) {
    const double plate =
        std::max({std::abs(p.x()) - 6, std::abs(p.y()) - 6, std::abs(p.z()) - thickness / 2});
    return std::min(p.norm() - 3, plate);
  });
}

/// A ball with tufts all over it, which taper and stand close together.
TriangleMesh tufted_ball() {
  constexpr int kTufts = 40;
  std::vector<Eigen::Vector3d> axes;
  for (int i = 0; i < kTufts; ++i) {
    const double z = 1 - (2 * i + 1.0) / kTufts, turn = i * std::numbers::pi * (3 - std::sqrt(5));
    const double across = std::sqrt(1 - z * z);
    axes.emplace_back(across * std::cos(turn), across * std::sin(turn), z);
  }
  return solid_of(64, 10, [&](const Eigen::Vector3d& p) {
    double distance = p.norm() - 3;
    for (std::size_t i = 0; i < axes.size(); ++i) {
      const double along = p.dot(axes[i]), length = i % 3 == 0 ? 4.5 : 3.6;
      if (along <= 0) continue;
      distance = std::min(distance, (p - along * axes[i]).norm() - 0.25 * (length - along));
    }
    return distance;
  });
}

}  // namespace

TEST_CASE("a print has the size that was asked for") {
  const TriangleMesh box = shapes::box({0, 0, 0}, {1, 2, 3});
  const PrintMesh high = made_printable(box, {.up = UpAxis::y, .height = 80});
  CHECK(high.report.scale == Catch::Approx(40));
  CHECK(high.mesh.box().size().y() == Catch::Approx(80).epsilon(1e-9));
  CHECK(high.mesh.triangles == box.triangles);
  const PrintMesh longest = made_printable(box, {.up = UpAxis::minus_x, .longest = 60});
  CHECK(longest.mesh.box().size().z() == Catch::Approx(60).epsilon(1e-9));
  CHECK(longest.report.printed_volume == Catch::Approx(6 * 8000));
  // With a foot cut off and fewer triangles it has that size, too.
  const PrintMesh ball =
      made_printable(shapes::sphere(4), {.height = 40, .flat_foot = 4, .max_triangles = 4000});
  CHECK(ball.mesh.box().size().z() == Catch::Approx(40).epsilon(1e-9));
  CHECK(ball.mesh.triangles.size() <= 4000);
  check_solid(ball.mesh);
}

TEST_CASE("thin walls grow to what was asked for, and thick ones stay") {
  const TriangleMesh thin = ball_with_plate(0.5);
  const PrintMesh made = made_printable(thin, {.min_wall = 1});
  check_solid(made.mesh);
  CHECK(made.report.thinnest_before < 0.6);
  CHECK(made.report.thinnest >= 1);
  CHECK(wall_thickness(made.mesh).thinnest >= 1);
  CHECK(made.report.printed_volume > 1.2 * made.report.volume);
  CHECK(made.report.printed_volume < 1.6 * made.report.volume);
  // The ball, away from the plate, is where it was.
  int on_ball = 0;
  for (const Eigen::Vector3d& x : made.mesh.vertices) {
    if (std::abs(x.z()) < 1.5) continue;
    ++on_ball;
    CHECK(x.norm() == Catch::Approx(3).margin(0.05));
  }
  CHECK(on_ball > 1000);
  // Nothing is done to what is thick enough.
  const TriangleMesh ball = shapes::sphere(4);
  CHECK(made_printable(ball, {.min_wall = 1}).mesh.vertices == ball.vertices);
}

TEST_CASE("walls and size are reached together, in few steps") {
  const TriangleMesh tufted = tufted_ball();
  constexpr double kWall = 2;
  std::set<std::string> steps;
  ProgressMonitor monitor;
  monitor.on_progress = [&](const Progress& progress) { steps.insert(progress.detail); };
  const PrintOptions options{.height = 80, .min_wall = kWall};
  const PrintMesh made = made_printable(tufted, options, monitor);
  check_solid(made.mesh);
  CHECK(made.mesh.box().size().z() == Catch::Approx(80).epsilon(1e-9));
  CHECK(wall_thickness(made.mesh).thinnest >= kWall);
  CHECK(steps.contains("step 1 of at most 6"));
  CHECK(made.report.printed_volume < 1.5 * made.report.volume);
}

TEST_CASE("a foot is flat, and at the height where it was cut") {
  const UpAxis up = GENERATE(UpAxis::z, UpAxis::minus_y);
  const PrintMesh made =
      made_printable(shapes::sphere(5, 5), {.up = up, .flat_foot = 1, .keep_loose = true});
  check_solid(made.mesh);
  const Eigen::Vector3d direction = qjulia::direction(up);
  double lowest = 0;
  for (const Eigen::Vector3d& x : made.mesh.vertices) lowest = std::min(lowest, x.dot(direction));
  CHECK(lowest == Catch::Approx(-4).epsilon(1e-3));
  double area = 0;
  for (const auto& [a, b, c] : made.mesh.triangles) {
    const auto& x = made.mesh.vertices;
    const Eigen::Vector3d normal = (x[b] - x[a]).cross(x[c] - x[a]) / 2;
    const bool is_foot = x[a].dot(direction) == lowest && x[b].dot(direction) == lowest &&
                         x[c].dot(direction) == lowest;
    if (is_foot) area -= normal.dot(direction);
  }
  CHECK(area == Catch::Approx(std::numbers::pi * 9).epsilon(0.05));
  const double cap = std::numbers::pi * (3 * 5 - 1) / 3;
  CHECK(made.report.volume - made.report.printed_volume == Catch::Approx(cap).epsilon(0.1));
}

TEST_CASE("a hollow print has a wall of one thickness and a drain") {
  const TriangleMesh ball = shapes::sphere(5, 10);
  const PrintMesh made = made_printable(ball, {.shell = 2, .drain = 3});
  check_solid(made.mesh);
  const double wall = 4 * std::numbers::pi / 3 * (1000 - 512);
  const double drain = std::numbers::pi * 1.5 * 1.5 * 2;
  CHECK(made.report.printed_volume == Catch::Approx(wall - drain).epsilon(0.02));
  CHECK(made.report.cavity == Catch::Approx(4 * std::numbers::pi / 3 * 512).epsilon(0.05));
  CHECK(wall_thickness(made.mesh).median == Catch::Approx(2).epsilon(0.03));
  // The drain leads down: no vertex is near the lower pole.
  for (const Eigen::Vector3d& x : made.mesh.vertices) {
    if (x.z() < -7) CHECK(x.head<2>().norm() > 1.15);
  }
  const PrintMesh closed = made_printable(ball, {.shell = 2, .drain = 0});
  CHECK(inspect(closed.mesh).closed());
  CHECK(inspect(closed.mesh).components == 2);
}

TEST_CASE("a shell keeps its thickness below a groove between the points of the cavity's grid") {
  // A ball with a slot from above, a third of a cell wide and half-way between planes of the grid,
  // whose cells are a quarter of the shell.
  constexpr double kShell = 3, kCell = kShell / 4, kFloor = 6;
  const double middle = -10 + (17 + 0.5 - 3.4231) * kCell;
  const TriangleMesh body = solid_of(200, 22, [&](const Eigen::Vector3d& p) {
    const double slot = std::max(std::abs(p.x() - middle) - kCell / 6, kFloor - p.z());
    return std::max(p.norm() - 10, -slot);
  });
  const PrintMesh made = made_printable(body, {.shell = kShell, .drain = 0});
  CHECK(inspect(made.mesh).components == 2);
  const shape::TriangleTree outside(body);
  int between = 0, deep = 0;
  for (const Eigen::Vector3d& x : made.mesh.vertices) {
    const double distance = outside.nearest(x, 0).distance;
    if (distance > 0.1 * kShell && distance < 0.97 * kShell) ++between;
    if (distance >= 0.97 * kShell) ++deep;
  }
  CHECK(between == 0);
  CHECK(deep > 1000);
}

TEST_CASE("a drain ends outside and leaves alone what lies below") {
  // A ball above a plate, 1.5 below it, which a post connects to the ball.
  const TriangleMesh body = solid_of(150, 32, [](const Eigen::Vector3d& p) {
    const Eigen::Vector3d up = p - Eigen::Vector3d(0, 0, 2);
    const double plate = std::max(p.head<2>().norm() - 8, std::abs(p.z() + 10.5) - 1);
    const double post =
        std::max((p.head<2>() - Eigen::Vector2d(6, 0)).norm() - 1.2, std::abs(p.z() + 7) - 3);
    return std::min({up.norm() - 10, plate, post});
  });
  const auto near_axis = [](const TriangleMesh& mesh, double low, double high) {
    return std::ranges::count_if(mesh.vertices, [&](const Eigen::Vector3d& x) {
      return x.head<2>().norm() < 1 && x.z() > low && x.z() < high;
    });
  };
  const PrintMesh made = made_printable(body, {.shell = 2, .drain = 3});
  check_solid(made.mesh);
  CHECK(near_axis(made.mesh, -8.5, -5.5) == 0);  // the hole through the ball
  CHECK(near_axis(made.mesh, -12, -9) >= near_axis(body, -12, -9) / 2);  // the plate's two sides
}

TEST_CASE("balls that thicken a wall stand on the flat foot") {
  // A column on a thin plate, of which the foot takes a part.
  const TriangleMesh body = solid_of(120, 20, [](const Eigen::Vector3d& p) {
    const double plate = std::max(p.head<2>().norm() - 8, std::abs(p.z() + 4.5) - 0.5);
    return std::min(plate, std::max(p.head<2>().norm() - 3, std::abs(p.z()) - 5));
  });
  const PrintMesh made = made_printable(body, {.min_wall = 2, .flat_foot = 0.4});
  check_solid(made.mesh);
  CHECK(made.report.thinnest >= 2);
}

TEST_CASE("a shell as thick as the least wall has that wall") {
  const PrintMesh made =
      made_printable(shapes::sphere(5, 10), {.min_wall = 2, .shell = 2, .drain = 0});
  CHECK(made.report.thinnest >= 2);
  CHECK(wall_thickness(made.mesh).median < 2.1);
}

TEST_CASE("too few triangles for the walls are what a refusal names") {
  std::set<std::string> steps;
  ProgressMonitor monitor;
  monitor.on_progress = [&](const Progress& progress) { steps.insert(progress.detail); };
  const PrintOptions options{.height = 80, .min_wall = 2, .max_triangles = 400};
  CHECK_THROWS_WITH(made_printable(tufted_ball(), options, monitor),
                    Catch::Matchers::ContainsSubstring("with so few triangles"));
  // It is refused as soon as a decimation has shown how much of the walls gets lost.
  CHECK(steps.contains("step 1 of at most 6"));
  CHECK_FALSE(steps.contains("step 4 of at most 6"));
}

TEST_CASE("few triangles are made of a mesh that is not much finer than they are") {
  const PrintOptions fine{.height = 80, .min_wall = 2};
  PrintOptions few = fine;
  few.max_triangles = 20000;
  const TriangleMesh ball = tufted_ball();
  const PrintMesh made = made_printable(ball, few);
  check_solid(made.mesh);
  CHECK(made.report.thinnest >= 2);
  const auto before = static_cast<double>(made.report.decimation.value().before);
  CHECK(before < 0.7 * static_cast<double>(made_printable(ball, fine).mesh.triangles.size()));
}

TEST_CASE("what cannot be printed so is refused by name") {
  const TriangleMesh ball = shapes::sphere(3);
  const auto fails = [&](const PrintOptions& options, const char* text) {
    CHECK_THROWS_WITH(made_printable(ball, options), Catch::Matchers::ContainsSubstring(text));
  };
  fails({.height = 2, .longest = 3}, "contradict");
  fails({.min_wall = 0.5, .shell = 0.2}, "shell");
  fails({.flat_foot = 2}, "cut off less");
  fails({.shell = 1}, "no cavity");
  fails({.shell = 0.2}, "drain");
  fails({.min_wall = 1e-5, .shell = 1e-4}, "shell");
  fails({.max_triangles = 3}, "4 or more");
  CHECK_THROWS_WITH(made_printable(shapes::open_box(), {.min_wall = 0.1}),
                    Catch::Matchers::ContainsSubstring("open"));
}
