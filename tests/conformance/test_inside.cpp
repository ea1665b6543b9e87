// A point is inside at n where F_n < L. Surfaces, samples, comparisons and pictures each find such
// points in their own way. For random maps with random knobs they must find the same ones.

#include <catch2/catch_all.hpp>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "armed_ball.hpp"
#include "distance_map.hpp"
#include "map/portals.hpp"
#include "map/reference_iteration.hpp"
#include "map_checks.hpp"
#include "mesh/overlap.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/exact/exact_map.hpp"
#include "qjulia/map/detail.hpp"
#include "qjulia/map/knobs.hpp"
#include "qjulia/map/sample.hpp"
#include "qjulia/mesh/shape.hpp"
#include "qjulia/surface/compare.hpp"
#include "qjulia/surface/surface.hpp"
#include "random_maps.hpp"
#include "shapes.hpp"
#include "surface/narrow_band.hpp"
#include "test_device.hpp"

using namespace qjulia;
using Eigen::Vector3d;

namespace {

/// A map with its knobs turned, in map coordinates.
struct Turned {
  std::string name;
  Map map;
  int iterations = 6;
};

/// Makes shape coordinates equal to map coordinates, so that grids of dyadic numbers are exact in
/// both.
Map in_map_coordinates(Map map) {
  map.frame.shape_to_map = {};
  map.frame.box.reset();
  return map;
}

Map exact(const TriangleMesh& mesh) {
  ExactMapOptions options;
  options.resolution = 64;
  return exact_map(test::shared_device(), mesh, options);
}

Turned scaled(const std::string& name, const Map& map, double detail, double scale) {
  MapKnobs knobs;
  knobs.detail = detail;
  knobs.scale = scale;
  return {name, in_map_coordinates(with_knobs(test::shared_device(), map, knobs))};
}

/// Orbits of these come to rest between e^L and the largest ball that the map takes into itself.
std::vector<Turned> swollen() {
  const Map ball = exact(shapes::sphere(4));
  return {scaled("ball, detail .02, scale 2", ball, 0.02, 2),
          scaled("ball, detail .1, scale 1.5", ball, 0.1, 1.5),
          scaled("torus, detail .05, scale 1.6", exact(shapes::torus()), 0.05, 1.6)};
}

/// Draws the parts of a map at random.
class Draw {
 public:
  explicit Draw(std::uint64_t seed) : bits_(seed) {}

  double between(double low, double high) { return test::uniform(bits_, low, high); }
  /// Uniform in the logarithm.
  double ratio(double low, double high) { return std::exp(between(std::log(low), std::log(high))); }
  bool chance(double of) { return between(0, 1) < of; }
  int count(int low, int high) { return low + static_cast<int>(between(0, high - low + 1)); }
  Vector3d direction() {
    Vector3d x;
    do {
      for (double& c : x) c = between(-1, 1);
    } while (x.norm() > 1 || x.norm() < 0.1);
    return x.normalized();
  }
  Quaternion quaternion() {
    return {between(-1, 1), between(-1, 1), between(-1, 1), between(-1, 1)};
  }
  NoiseVersor noise() {
    return {count(1, 3), ratio(1, 9), static_cast<std::uint32_t>(count(0, 99)),
            chance(0.5) ? NoiseValues::vectors : NoiseValues::quaternions, Vector3d::Zero()};
  }
  Paint paint() {
    Paint paint;
    paint.cells = {6, 6, 6};
    paint.origin = {-1.5, -1.5, -1.5};
    paint.step = 0.5;
    for (std::size_t i = 0; i < paint.size(); ++i) {
      paint.shares.push_back(static_cast<std::uint8_t>(count(0, 255)));
    }
    return paint;
  }
  Portal portal() {
    constexpr PortalMask kMasks[] = {PortalMask::none, PortalMask::outside, PortalMask::inside};
    return {between(0.7, 1.5) * direction(), ratio(0.1, 0.5),   ratio(0.5, 10),
            {direction(), between(0, 360)},  0.3 * direction(), kMasks[count(0, 2)]};
  }

 private:
  std::mt19937_64 bits_;
};

Map fitted() {
  static const Map map =
      with_detail(calibrated(test::shared_device(),
                             with_measured_detail(test::shared_device(), test::armed_ball_map(60),
                                                  test::armed_ball_surface(1000))),
                  0.02);
  return map;
}

/// Turns each knob that the map has, or leaves it, at random.
MapKnobs knobs_of(const Map& map, Draw& draw) {
  constexpr double kUsual = 0.4;
  const bool is_exact = std::holds_alternative<DistanceModulus>(map.dynamics.modulus);
  MapKnobs knobs;
  if (map.frame.detail) knobs.detail = draw.ratio(0.002, is_exact ? 0.1 : 0.04);
  if (draw.chance(0.7)) knobs.scale = draw.ratio(0.5, 3);
  if (draw.chance(kUsual)) knobs.phase = draw.quaternion();
  if (draw.chance(kUsual)) knobs.slice = draw.between(-0.3, 0.3);
  if (draw.chance(kUsual)) knobs.steepness = draw.ratio(1, kMostSteepness);
  if (map.dynamics.is_rational() && draw.chance(kUsual)) {
    knobs.rotate = Rotation{draw.direction(), draw.between(0, 360)};
  }
  if (!map.dynamics.factors.empty() && draw.chance(kUsual)) knobs.order_seed = 7;
  if (map.frame.inradius && draw.chance(0.2)) knobs.drift = draw.between(0, 1.05);
  if (map.frame.inradius && draw.chance(0.2)) knobs.translate = 0.3 * draw.direction();
  return knobs;
}

/// Draws knobs again if they take the origin out of the shape or make F too flat.
Map with_allowed_knobs(const Map& map, Draw& draw) {
  for (;;) {
    try {
      return with_knobs(test::shared_device(), map, knobs_of(map, draw));
    } catch (const InputError&) {
      continue;
    }
  }
}

Turned random_turned(int number) {
  Draw draw(static_cast<std::uint64_t>(number));
  Map map;
  Turned turned;
  const int kind = number % 6;
  switch (kind) {
    case 0:
      turned.name = "fitted";
      map = fitted();
      break;
    case 1:
      turned.name = "quadratic";
      map = quadratic_map(draw.quaternion());
      map.dynamics.surface_level = draw.between(-0.5, 0.7);
      break;
    case 2:
      turned.name = "exact, noise";
      map = test::distance_map();
      map.dynamics.factors.clear();
      map.dynamics.versor = draw.noise();
      break;
    default:
      turned.name = kind == 3 ? "exact" : kind == 4 ? "exact, painted" : "exact, portals";
      map = test::distance_map(0.1, draw.count(3, 30));
      for (Factor& factor : map.dynamics.factors) factor.exponent = draw.count(2, 13);
  }
  turned.name = "map " + std::to_string(number) + ", " + turned.name;
  turned.map = in_map_coordinates(with_allowed_knobs(map, draw));
  turned.iterations = draw.count(1, 9);
  if (kind == 4) turned.map.layers.paint = draw.paint();
  while (kind == 5 && turned.map.layers.portals.empty()) {
    turned.map.layers.portals.assign({draw.portal(), draw.portal()});
    try {
      turned.map.validate();
    } catch (const InputError&) {
      turned.map.layers.portals.clear();
    }
  }
  return turned;
}

/// A grid whose origin and step have few bits, so that its points are exact wherever they are
/// computed.
surface::Grid exact_grid(int number, double step = 0.15625) {
  constexpr double kReach = 1.75;
  surface::Grid grid;
  grid.step = step;
  grid.origin = Vector3d::Constant(-kReach) +
                Vector3d(number % 7, number % 11, number % 13) / 256;  // no point has a symmetry
  grid.points.setConstant(static_cast<int>(2 * kReach / step) + 1);
  return grid;
}

/// The box whose cells have the grid's points as centres.
Box cells_about(const surface::Grid& grid) {
  const Vector3d half = Vector3d::Constant(0.5 * grid.step);
  return {grid.origin - half, grid.point(grid.points) - half};
}

template <class Real>
std::vector<bool> insides(const std::vector<Real>& values, double level) {
  std::vector<bool> inside;
  for (const Real value : values) inside.push_back(static_cast<double>(value) < level);
  return inside;
}

/// The inside by `sample_field`, with its default escape radius.
std::vector<bool> sampled(const Turned& turned, const surface::Grid& grid) {
  SampleOptions options;
  options.iterations = turned.iterations;
  const CellGrid cells{cells_about(grid), {grid.points.x(), grid.points.y(), grid.points.z()}};
  std::vector<double> values;
  sample_field(
      test::shared_device(), turned.map, options, cells, CellOrder::x_fastest,
      [&](std::span<const double> part) { values.insert(values.end(), part.begin(), part.end()); });
  return insides(values, turned.map.dynamics.surface_level);
}

/// The inside as a surface finds it: by blocks, then by interpolation, then by orbits.
std::vector<bool> sparse(const surface::LevelSet& set, const surface::Grid& grid, double level) {
  std::vector<bool> inside(whole(grid).size());
  const std::size_t slice = slices(grid, 0, 1).size();
  for (int z = 0; z < grid.points.z();) {
    for (const surface::Slab& slab : narrow_band(set, grid, level, z)) {
      const surface::GridBlock block = slices(grid, z, slab.slices);
      std::vector<std::int32_t> unknown;
      surface::for_points(block.count, [&](std::size_t number, const Eigen::Vector3i& at) {
        for (const surface::PointRun& run : slab.row(at.y())) {
          if (at.x() < run.begin || at.x() >= run.end) continue;
          if (run.side == surface::Side::unknown) unknown.push_back(static_cast<int>(number));
          if (run.side != surface::Side::inside) continue;
          inside[static_cast<std::size_t>(z) * slice + number] = true;
        }
      });
      std::vector<float> values(block.size());
      set.clamped_at(grid, block, unknown, {level, 0.25, 0.25}, values);
      for (const std::int32_t number : unknown) {
        const auto i = static_cast<std::size_t>(number);
        inside[static_cast<std::size_t>(z) * slice + i] = static_cast<double>(values[i]) < level;
      }
      z += slab.slices;
    }
  }
  return inside;
}

std::size_t differing(const std::vector<bool>& a, const std::vector<bool>& b) {
  REQUIRE(a.size() == b.size());
  std::size_t count = 0;
  for (std::size_t i = 0; i < a.size(); ++i) count += a[i] != b[i] ? 1 : 0;
  return count;
}

/// Checks all ways at the points of a grid. @return how many points are inside.
std::size_t check_grids(const Turned& turned, const surface::Grid& grid) {
  const Map& map = turned.map;
  const double level = map.dynamics.surface_level;
  const StopRadii stops = find_stop_radii(test::shared_device(), map);
  CAPTURE(turned.name, turned.iterations, level, stops.inner, stops.outer, stops.escape);
  CHECK(stops.inner < std::exp(level));
  CHECK(stops.outer > std::exp(level));
  const surface::LevelSet set(test::shared_device(), map, stops, turned.iterations);
  const std::vector<bool> expected = sampled(turned, grid);
  CHECK(differing(expected, insides(set.densely_over(grid, whole(grid), level), level)) == 0);
  // What `compare` counts.
  CHECK(differing(expected, insides(set.over(grid, whole(grid)), level)) == 0);
  CHECK(differing(expected, sparse(set, grid, level)) == 0);
  return static_cast<std::size_t>(std::ranges::count(expected, true));
}

/// Checks that `compare` counts the points of the grid that lie in the set and in a ball.
void check_comparison(const Turned& turned, const surface::Grid& grid) {
  const TriangleMesh ball = shapes::sphere(3, 0.9);
  const SignedDistance distance = outer_surface(test::shared_device(), ball).distance;
  std::vector<Vector3d> points;
  surface::for_points(grid.points, [&](std::size_t /*number*/, const Eigen::Vector3i& at) {
    points.push_back(grid.point(at));
  });
  const std::vector<double> to_ball = distance.at(points);
  const std::vector<bool> inside = sampled(turned, grid);
  shape::Overlap overlap;
  for (std::size_t i = 0; i < inside.size(); ++i) overlap.add(to_ball[i] < 0, inside[i]);
  CompareOptions options;
  options.resolution = grid.points.x();
  options.iterations = turned.iterations;
  options.box = cells_about(grid);
  CAPTURE(turned.name, turned.iterations);
  CHECK(compare(test::shared_device(), turned.map, ball, options).back().iou == overlap.iou());
}

/// Checks that a mesh has the same vertices whether orbits are run everywhere or only where needed.
void check_meshes(const Turned& turned, const surface::Grid& grid) {
  SurfaceOptions options;
  options.resolution = grid.points.x() - 1;
  options.iterations = turned.iterations;
  options.box = Box{grid.origin, grid.point(grid.points.array() - 1)};
  const TriangleMesh mesh = extract_surface(test::shared_device(), turned.map, options);
  options.dense = true;
  const TriangleMesh dense = extract_surface(test::shared_device(), turned.map, options);
  CAPTURE(turned.name, turned.iterations);
  CHECK(mesh.vertices == dense.vertices);
  CHECK(mesh.triangles == dense.triangles);
}

}  // namespace

TEST_CASE("swollen maps have the same inside in samples, surfaces and comparisons") {
  for (const Turned& turned : swollen()) {
    CHECK(check_grids(turned, exact_grid(1, 0.0625)) > 1000);
    check_comparison(turned, exact_grid(1));
    check_meshes(turned, exact_grid(1));
  }
}

TEST_CASE("pictures of swollen maps show the inside that orbits have") {
  // The steps of rays allow for a versor that turns about as fast as F rises.
  for (Turned turned : swollen()) {
    turned.map.dynamics.factors = {{{0.1, 0.2, 0, 0}, 1}};
    CAPTURE(turned.name);
    test::check_rays(test::shared_device(), turned.map, surface::cube(1.6), turned.iterations);
  }
}

TEST_CASE("random maps have the same inside in samples, surfaces, comparisons and pictures") {
  constexpr int kMaps = 78;
  constexpr int kEach = 13, kEachPicture = 65;  // a map of every kind by turns
  const auto maps = static_cast<int>(test::sweep_size(512)) * kMaps / 512;
  int drawn = 0;
  for (int number = 0; number < maps; ++number) {
    const Turned turned = random_turned(number);
    const surface::Grid grid = exact_grid(number);
    const std::size_t inside = check_grids(turned, grid);
    if (inside > 0) ++drawn;
    if (number % kEach > 0) continue;
    check_comparison(turned, grid);
    check_meshes(turned, grid);
    // Enough of the picture, and no dust.
    if (number % kEachPicture > 0 || inside < whole(grid).size() / 10) continue;
    CAPTURE(turned.name, turned.iterations);
    test::check_rays(test::shared_device(), turned.map, surface::cube(1.5), turned.iterations);
  }
  CHECK(drawn > maps * 3 / 4);
}

TEST_CASE("samples follow orbits through portals that reach beyond the usual escape radius") {
  Turned turned{"far portal", in_map_coordinates(test::distance_map()), 4};
  turned.map.layers.portals = {{{25, 0, 0}, 3, 0.5, {}, {0, 0, 0}, PortalMask::none}};
  surface::Grid grid = exact_grid(1, 0.25);
  grid.origin += Vector3d(25, 0, 0);
  CHECK(check_grids(turned, grid) > 100);
}
