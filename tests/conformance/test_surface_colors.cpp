// Colours of a surface's vertices, against what orbits of q² are known to do.

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <stop_token>

#include "base/srgb.hpp"
#include "check/unit_ball.hpp"
#include "qjulia/error.hpp"
#include "qjulia/surface_colors.hpp"
#include "shapes.hpp"
#include "test_device.hpp"

using namespace qjulia;

namespace {

constexpr double kShapeToMap = 0.5;

/// The unit ball of q², in a shape's coordinates that are not the map's.
Map placed_ball() {
  Map map = check::unit_ball();
  map.frame.shape_to_map = {kShapeToMap, {0.5, -0.25, 1}};
  map.frame.box = Box{map.frame.shape_to_map.to_shape(map.frame.box->low),
                      map.frame.shape_to_map.to_shape(map.frame.box->high)};
  return map;
}

/// Its surface.
TriangleMesh sphere_of(const Map& map, int level) {
  TriangleMesh mesh = shapes::sphere(level);
  for (auto& x : mesh.vertices) x = map.frame.shape_to_map.to_shape(x);
  return mesh;
}

/// Black to white, so that colours tell the share of the way through the palette.
SurfaceColorOptions in_grey(Material material) {
  SurfaceColorOptions options;
  options.material = material;
  options.palette.stops = {Rgb::Zero(), Rgb::Ones()};
  return options;
}

double share_of(const VertexColor& color) { return base::srgb_decoded(color[0] / 255.0); }

}  // namespace

TEST_CASE("orbits of a ball that all end alike have one colour") {
  const Map map = placed_ball();
  const TriangleMesh mesh = sphere_of(map, 2);
  // Points a quarter of an edge within the sphere are below r_in once they are squared.
  const SurfaceColors found = surface_colors(test::shared_device(), map, mesh, {});
  REQUIRE(found.colors.size() == mesh.vertices.size());
  CHECK(found.low == 0);
  CHECK(found.high == 1);
  const Rgb first = Palette().stops.front();
  for (const VertexColor& color : found.colors) {
    for (std::size_t c = 0; c < 3; ++c) {
      const double wanted = 255 * base::srgb_encoded(first[static_cast<Eigen::Index>(c)]);
      REQUIRE(std::abs(color[c] - wanted) <= 0.5);
    }
  }
}

TEST_CASE("a trap's colours show how close the square of a point comes to the plane X = 0") {
  const Map map = placed_ball();
  const TriangleMesh mesh = sphere_of(map, 4);
  const SurfaceColors found =
      surface_colors(test::shared_device(), map, mesh, in_grey(Material::trap));
  REQUIRE(found.colors.size() == mesh.vertices.size());
  CHECK(found.low < 0.1);
  CHECK(found.high > 0.9);
  double worst = 0, least = 1, most = 0;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const double x = map.frame.shape_to_map.to_map(mesh.vertices[v]).x();
    // Re q² = X² − Y² − Z², over |q|² = 1. Orbits end with it, as r_in is close below the sphere.
    const double wanted = std::clamp(std::abs(2 * x * x - 1), found.low, found.high);
    const double share = share_of(found.colors[v]);
    worst = std::max(worst, std::abs(found.low + share * (found.high - found.low) - wanted));
    least = std::min(least, share);
    most = std::max(most, share);
  }
  CHECK(worst < 0.08);
  CHECK(least == 0);
  CHECK(most == 1);
}

TEST_CASE("two in a hundred vertices lie below the palette, and two above it") {
  const Map map = placed_ball();
  const TriangleMesh mesh = sphere_of(map, 4);
  const SurfaceColors found =
      surface_colors(test::shared_device(), map, mesh, in_grey(Material::trap));
  const auto share_with = [&](std::uint8_t grey) {
    const auto count = std::ranges::count(found.colors, VertexColor{grey, grey, grey});
    return static_cast<double>(count) / static_cast<double>(mesh.vertices.size());
  };
  CHECK(share_with(0) > 0.015);
  CHECK(share_with(0) < 0.03);
  CHECK(share_with(255) > 0.015);
  // |Re q²| is flat where it is 1, and what is a little less is white in 8 bits, too.
  CHECK(share_with(255) < 0.08);
}

TEST_CASE("colours that cannot be given are refused, and a stop is heard") {
  const Map map = placed_ball();
  const TriangleMesh mesh = sphere_of(map, 1);
  const auto colored = [&](const SurfaceColorOptions& options) {
    surface_colors(test::shared_device(), map, mesh, options);
  };
  CHECK_THROWS_WITH(colored({.material = Material::clay}), Catch::Contains("material"));
  CHECK_THROWS_WITH(colored({.palette = {.stops = {Rgb::Ones()}}}), Catch::Contains("palette"));
  CHECK_THROWS_WITH(colored({.iterations = 0}), Catch::Contains("iterations"));
  std::stop_source source;
  source.request_stop();
  CHECK_THROWS_AS(surface_colors(test::shared_device(), map, mesh, {}, {{}, source.get_token()}),
                  Interrupted);
  CHECK(surface_colors(test::shared_device(), map, {}, {}).colors.empty());
}
