// Colours of a surface's vertices, against what orbits of q² are known to do and against pictures.

#include <algorithm>
#include <array>
#include <catch2/catch_all.hpp>
#include <cmath>
#include <stop_token>

#include "armed_ball.hpp"
#include "base/srgb.hpp"
#include "check/unit_ball.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/map/detail.hpp"
#include "qjulia/picture/surface_colors.hpp"
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

TEST_CASE("what is finer than a mesh has one colour") {
  const Map map = placed_ball();
  const TriangleMesh mesh = sphere_of(map, 2);
  // The shell of a ball is much thinner than the triangles are wide.
  const SurfaceColors found =
      surface_colors(test::shared_device(), map, mesh, in_grey(Material::iterations));
  REQUIRE(found.colors.size() == mesh.vertices.size());
  CHECK(found.range.high - found.range.low == Catch::Approx(1e-3));
  const auto [least, most] = std::ranges::minmax(found.colors);
  CHECK(most[0] - least[0] <= 4);
}

TEST_CASE("a trap's colours show how close two iterates come to the plane X = 0") {
  const Map map = placed_ball();
  const TriangleMesh mesh = sphere_of(map, 5);
  SurfaceColorOptions options = in_grey(Material::trap);
  options.range = MaterialRange{0, 1};
  const std::vector<VertexColor> colors =
      surface_colors(test::shared_device(), map, mesh, options).colors;
  REQUIRE(colors.size() == mesh.vertices.size());
  double worst = 0;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const double x = map.frame.shape_to_map.to_map(mesh.vertices[v]).x();
    // Re q² = X² − Y² − Z² and Re q⁴ = 2 (Re q²)² − 1, over |q| = 1.
    const double once = 2 * x * x - 1, twice = 2 * once * once - 1;
    const double wanted = std::min(std::abs(once), std::abs(twice));
    worst = std::max(worst, std::abs(share_of(colors[v]) - wanted));
  }
  CHECK(worst < 0.1);
  // When the palette is spread over the vertices, each third of it is seen equally often.
  const SurfaceColors spread =
      surface_colors(test::shared_device(), map, mesh, in_grey(Material::trap));
  CHECK_FALSE(spread.range.between.empty());
  std::array<std::size_t, 3> seen{};
  for (const VertexColor& color : spread.colors) {
    ++seen.at(static_cast<std::size_t>(std::min(2.0, 3 * share_of(color))));
  }
  for (const std::size_t count : seen) CHECK(count > mesh.vertices.size() / 5);
}

TEST_CASE("heights go up the map's own axis, from one end of the palette to the other") {
  Map map = placed_ball();
  map.frame.up = UpAxis::minus_x;
  const TriangleMesh mesh = sphere_of(map, 3);
  const SurfaceColors found =
      surface_colors(test::shared_device(), map, mesh, in_grey(Material::height));
  const MaterialRange& range = found.range;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const double wanted =
        std::clamp((-mesh.vertices[v].x() - range.low) / (range.high - range.low), 0.0, 1.0);
    REQUIRE(std::abs(share_of(found.colors[v]) - wanted) < 0.01);
  }
  // A ball of radius 1 / kShapeToMap about x = -1: most of it lies in the range.
  CHECK(range.low == Catch::Approx(1 - 1 / kShapeToMap).margin(0.3));
  CHECK(range.high == Catch::Approx(1 + 1 / kShapeToMap).margin(0.3));
}

namespace {

/// A triangle mesh through what a picture's pixels show, and the pixel of each vertex.
struct SeenMesh {
  TriangleMesh mesh;
  std::vector<std::size_t> pixels;
  std::vector<double> longest_edges;  ///< about each vertex; 0 without any
};

SeenMesh mesh_seen(const LayeredImage& picture) {
  SeenMesh seen;
  const auto width = static_cast<std::size_t>(picture.image.width);
  const std::vector<float>& position = picture.layers.position;
  std::vector<std::uint32_t> numbers(position.size() / 3);
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (std::isinf(picture.layers.depth[i])) continue;
    numbers[i] = static_cast<std::uint32_t>(seen.pixels.size());
    seen.mesh.vertices.emplace_back(position[3 * i], position[3 * i + 1], position[3 * i + 2]);
    seen.pixels.push_back(i);
  }
  for (std::size_t i = 0; i + width + 1 < numbers.size(); ++i) {
    const std::array corners{i, i + 1, i + width, i + width + 1};
    const auto [nearest, farthest] =
        std::ranges::minmax(corners, {}, [&](std::size_t j) { return picture.layers.depth[j]; });
    if (i % width + 1 == width || std::isinf(picture.layers.depth[farthest])) continue;
    const auto corner = [&](int j) { return numbers[corners[static_cast<std::size_t>(j)]]; };
    seen.mesh.triangles.push_back({corner(0), corner(1), corner(2)});
    seen.mesh.triangles.push_back({corner(1), corner(3), corner(2)});
  }
  seen.longest_edges.resize(seen.pixels.size());
  for (const Triangle& triangle : seen.mesh.triangles) {
    for (std::size_t c = 0; c < 3; ++c) {
      const std::uint32_t a = triangle[c], b = triangle[(c + 1) % 3];
      const double length = (seen.mesh.vertices[a] - seen.mesh.vertices[b]).norm();
      for (const std::uint32_t v : {a, b}) {
        seen.longest_edges[v] = std::max(seen.longest_edges[v], length);
      }
    }
  }
  return seen;
}

}  // namespace

TEST_CASE("a mesh has the colours of pictures of the same map") {
  const Device device = test::shared_device();
  const Map map = calibrated(device, steepened(test::armed_ball_map(60), 12));
  const Material material = GENERATE(Material::iterations, Material::trap, Material::groove,
                                     Material::height, Material::factor);
  CAPTURE(to_string(material));
  PictureOptions options;
  options.width = 96;
  options.height = 72;
  options.samples = 1;
  options.camera.zoom = 2.5;
  options.keep_loose = true;
  options.material = material;
  options.palette.stops = {Rgb::Zero(), Rgb::Ones()};
  Studio studio(device, map, options);
  const LayeredImage picture = studio.layered_picture(options.camera);
  const SeenMesh seen = mesh_seen(picture);
  REQUIRE(seen.pixels.size() > 2000);
  SurfaceColorOptions same = in_grey(material);
  same.range = studio.range();
  const SurfaceColors found = surface_colors(device, map, seen.mesh, same);
  CHECK(found.range == studio.range());
  std::vector<double> sorted = seen.longest_edges;
  std::ranges::nth_element(sorted, sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2));
  const double usual = sorted[sorted.size() / 2];
  // The same picture in one grey is brighter where the palette is darker than that.
  int compared = 0, wrong = 0;
  for (const double grey : {0.3, 0.7}) {
    options.palette.stops = {Rgb::Constant(grey), Rgb::Constant(grey)};
    const Image even = render(device, map, options);
    for (std::size_t v = 0; v < seen.pixels.size(); ++v) {
      const double share = share_of(found.colors[v]);
      if (std::abs(share - grey) < 0.2) continue;
      const int more = picture.image.pixels[3 * seen.pixels[v]] - even.pixels[3 * seen.pixels[v]];
      if (even.pixels[3 * seen.pixels[v]] < 16) continue;  // too dark to tell
      // Where edges are longer than a pixel is wide, a facet is filtered over more than a pixel.
      if (seen.longest_edges[v] > 2 * usual) continue;
      ++compared;
      if ((share > grey) != (more > 0)) ++wrong;
    }
  }
  CHECK(compared > 1500);
  CHECK(wrong < 0.02 * compared);
}

TEST_CASE("colours jump along the edges of a mesh that is too coarse for them") {
  // Heights of a range of a hundredth of the ball: black, a thin grey ring, white.
  const Map map = placed_ball();
  SurfaceColorOptions options = in_grey(Material::height);
  const double middle = direction(kDefaultUp).dot(map.frame.box->center());
  options.range = MaterialRange{middle - 0.01, middle + 0.01};
  std::vector<double> shares;
  for (const int level : {1, 3, 5}) {
    const TriangleMesh mesh = sphere_of(map, level);
    shares.push_back(surface_colors(test::shared_device(), map, mesh, options).abrupt_share);
  }
  CAPTURE(shares);
  // The ring crosses about one edge of 2^level.
  CHECK(shares[0] > 2 * shares[1]);
  CHECK(shares[1] > 2 * shares[2]);
  CHECK(shares[2] > 0);
}

TEST_CASE("a range that is given is kept") {
  const Map map = placed_ball();
  SurfaceColorOptions options = in_grey(Material::height);
  options.range = MaterialRange{10, 20};
  const SurfaceColors found =
      surface_colors(test::shared_device(), map, sphere_of(map, 1), options);
  CHECK(found.range == MaterialRange{10, 20});
  for (const VertexColor& color : found.colors) CHECK(color == VertexColor{0, 0, 0});
}

TEST_CASE("colours that cannot be given are refused, and a stop is heard") {
  const Map map = placed_ball();
  const TriangleMesh mesh = sphere_of(map, 1);
  const auto colored = [&](const SurfaceColorOptions& options) {
    surface_colors(test::shared_device(), map, mesh, options);
  };
  CHECK_THROWS_WITH(colored({.material = Material::clay}),
                    Catch::Matchers::ContainsSubstring("material"));
  CHECK_THROWS_WITH(colored({.palette = {.stops = {Rgb::Ones()}}}),
                    Catch::Matchers::ContainsSubstring("palette"));
  CHECK_THROWS_WITH(colored({.range = MaterialRange{1, 0}}),
                    Catch::Matchers::ContainsSubstring("range"));
  CHECK_THROWS_WITH(colored({.iterations = 0}), Catch::Matchers::ContainsSubstring("iterations"));
  std::stop_source source;
  source.request_stop();
  CHECK_THROWS_AS(surface_colors(test::shared_device(), map, mesh, {}, {{}, source.get_token()}),
                  Interrupted);
  CHECK(surface_colors(test::shared_device(), map, {}, {}).colors.empty());
}
