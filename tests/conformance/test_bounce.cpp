// Light that a shape sends on, against sums over all that a lamp lights.

#include <catch2/catch_all.hpp>
#include <cmath>
#include <numbers>

#include "layout/picture_layout.h"
#include "picture/bounce.hpp"
#include "picture/depth_source.hpp"
#include "picture/shading.hpp"
#include "test_device.hpp"

using namespace qjulia;
using Eigen::Vector3d;

namespace {

/// A square of side 2, from a corner along two axes, whose normal is u × v.
struct Square {
  Vector3d corner, u, v;
  Vector3d normal() const { return u.cross(v).normalized(); }
  Vector3d at(double a, double b) const { return corner + a * u + b * v; }
};

/// A floor and a wall that meet along z.
const Square kFloor{{-1, -1, -1}, {0, 0, 2}, {2, 0, 0}}, kWall{{-1, -1, -1}, {0, 2, 0}, {0, 0, 2}};

TriangleMesh corner() {
  TriangleMesh mesh;
  for (const Square& square : {kFloor, kWall}) {
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (const auto& [a, b] : {std::pair{0, 0}, {1, 0}, {1, 1}, {0, 1}}) {
      mesh.vertices.push_back(square.at(a, b));
    }
    mesh.triangles.push_back({first, first + 1, first + 2});
    mesh.triangles.push_back({first, first + 2, first + 3});
  }
  return mesh;
}

/// The irradiance, by π, of a point from a square that a lamp of color 1 lights all over.
double sent_on(const Square& square, double albedo, const Vector3d& lamp, const Vector3d& p,
               const Vector3d& n) {
  constexpr int kParts = 200;
  const Vector3d m = square.normal();
  const double area = square.u.cross(square.v).norm() / (kParts * kParts);
  double sum = 0;
  for (int i = 0; i < kParts; ++i) {
    for (int j = 0; j < kParts; ++j) {
      const Vector3d w = square.at((i + 0.5) / kParts, (j + 0.5) / kParts) - p;
      sum += std::max(0.0, n.dot(w)) * std::max(0.0, -m.dot(w)) / std::pow(w.squaredNorm(), 2);
    }
  }
  return sum * area * albedo * m.dot(lamp) / std::numbers::pi;
}

}  // namespace

TEST_CASE("a wall and a floor light each other as sums over their parts say") {
  const Device device = test::shared_device();
  const auto source = picture::mesh_source(corner());
  const Box held = source->bounds();
  const Vector3d towards = Vector3d(0.7, 0.6, 0.25).normalized();
  std::vector<picture::Light> lamps(1);
  lamps[0].towards = towards;
  lamps[0].color = Vector3d(1, 1, 1);
  lamps[0].view = picture::parallel_view(towards, held, 384);
  lamps[0].depths = source->depths(lamps[0].view, 0, lamps[0].view.rows);

  picture::Scene scene;
  scene.options.palette.clay = Rgb::Ones();
  scene.options.matter.roughness = 1;
  scene.options.ground = false;
  scene.rig.fill = 0;
  scene.options.background = background_from("black");
  constexpr double kAlbedo = 0.6;
  const picture::LitSurface lit =
      picture::lit_surface(lamps[0], picture::normals_of(device, lamps[0].view, lamps[0].depths));
  const std::vector<float> levels = picture::bounce_levels(
      lit, std::vector<Rgb>(lit.depths.size(), Rgb(kAlbedo, 0.5 * kAlbedo, 0)));

  constexpr int kSamples = 2;
  const picture::View view = picture::camera_view({.azimuth = 60, .elevation = 35, .up = UpAxis::y},
                                                  held, 80, 60, kSamples);
  const std::vector<float> depths = source->depths(view, 0, view.rows);
  const auto shaded = [&](double strength) {
    scene.options.light.bounce = strength;
    const picture::Shading shading(device, scene, {}, lamps, {}, std::span(&levels, 1));
    return shading.shade(view, {.rows = 60, .samples = kSamples, .depths = depths}, false).pixels;
  };
  const std::vector<float> with = shaded(2), without = shaded(0);
  int compared = 0;
  double sum_of_errors = 0, sum_of_squares = 0;
  for (int row = 0; row < 60; ++row) {
    for (int column = 0; column < 80; ++column) {
      const auto x = static_cast<std::size_t>(kSamples * column),
                 y = static_cast<std::size_t>(kSamples * row);
      const float depth = depths[y * static_cast<std::size_t>(view.columns) + x];
      if (depth < 0) continue;
      const Vector3d p = view.at(double(x) + 0.5, double(y) + 0.5, double{depth});
      const bool is_floor = std::abs(p.y() + 1) < 0.02, is_wall = std::abs(p.x() + 1) < 0.02;
      const double from_crease = is_floor ? p.x() + 1 : p.y() + 1;
      // Away from edges of the squares, and from the crease by some texels.
      if (is_floor == is_wall || from_crease < 0.06 || std::abs(p.z()) > 0.95 ||
          from_crease > 1.95) {
        continue;
      }
      const double right = is_floor ? sent_on(kWall, kAlbedo, towards, p, kFloor.normal())
                                    : sent_on(kFloor, kAlbedo, towards, p, kWall.normal());
      const std::size_t pixel = QJ_PIXEL_SIZE * static_cast<std::size_t>(80 * row + column);
      const double red = double{with[pixel] - without[pixel]} / 2;
      const double green = double{with[pixel + 1] - without[pixel + 1]} / 2;
      CAPTURE(column, row, p.transpose(), red / right);
      if (from_crease > 0.25) CHECK(red == Catch::Approx(right).epsilon(0.17));
      CHECK(green == Catch::Approx(0.5 * red).margin(1e-4));
      CHECK(with[pixel + 2] == Catch::Approx(without[pixel + 2]).margin(1e-5));
      sum_of_errors += red / right - 1;
      sum_of_squares += std::pow(red / right - 1, 2);
      ++compared;
    }
  }
  REQUIRE(compared > 800);
  CHECK(std::abs(sum_of_errors / compared) < 0.03);
  CHECK(std::sqrt(sum_of_squares / compared) < 0.05);
}
