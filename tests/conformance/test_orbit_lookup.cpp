// Surfaces whose orbits are looked up, against those whose orbits are computed.

#include <algorithm>
#include <catch2/catch_all.hpp>
#include <cmath>
#include <vector>

#include "armed_ball.hpp"
#include "lattice/clear_box.hpp"
#include "lattice/orbit_lookup.hpp"
#include "qjulia/map/detail.hpp"
#include "qjulia/surface/figures.hpp"
#include "qjulia/surface/surface.hpp"
#include "test_device.hpp"

using namespace qjulia;

namespace {

constexpr int kIterations = 6;

/// Its shell is about as thick, over its size, as that of maps as fits make them.
Map modern_map() {
  return calibrated(test::shared_device(), steepened(test::armed_ball_map(120), 30));
}

/// Whether the grid's points are inside.
std::vector<bool> labels(const surface::LevelSet& set, const surface::Grid& grid, double level) {
  const surface::GridBlock block = whole(grid);
  std::vector<float> values(block.size());
  set.clamped_at(grid, block, surface::all_numbers(block.size()), {level, 0.5, 0.5}, values);
  std::vector<bool> inside;
  for (const float value : values) inside.push_back(double{value} < level);
  return inside;
}

std::size_t count_differing(const std::vector<bool>& a, const std::vector<bool>& b) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < a.size(); ++i) count += a[i] != b[i] ? 1 : 0;
  return count;
}

}  // namespace

TEST_CASE("looking orbits up changes no more labels than a move by an eighth of a cell does") {
  const Map map = modern_map();
  const Device device =
      test::shared_device().with_lane_width(GENERATE(from_range(test::lane_widths())));
  const StopRadii stops = find_stop_radii(device, map);
  const double level = map.dynamics.surface_level;
  surface::LevelSet set(device, map, stops, kIterations);
  const Box box = map.frame.shape_to_map.to_map(*map.frame.box);
  surface::Grid grid = surface::grid_around(box, box.size().maxCoeff() / 90, 1);
  const std::vector<bool> right = labels(set, grid, level);
  surface::Grid moved = grid;
  moved.origin.array() += 0.125 * grid.step / std::sqrt(3.0);
  const std::size_t by_move = count_differing(right, labels(set, moved, level));

  const map::DeviceMap device_map(device, map, stops, Precision::single);
  const auto lookup = surface::make_lookup(device_map, set, level, grid, 0.25 * grid.step, {});
  REQUIRE(lookup);
  CHECK(lookup->lattice.trusted_share() > 0.5);
  set.reset_counts();
  set.look_up(lookup);
  const std::vector<bool> found = labels(set, grid, level);
  CHECK(set.counts().settled > right.size() / 20);
  CHECK(set.counts().iterated > 0);  // those too are compared whose first iterates are computed
  const std::size_t by_lookup = count_differing(right, found);
  CAPTURE(by_lookup, by_move);
  CHECK(by_lookup > 0);  // or else nothing was looked up
  CHECK(by_lookup <= by_move);
  // Points anywhere are looked up alike.
  std::vector<Eigen::Vector3d> points;
  surface::for_points(grid.points, [&](std::size_t, const Eigen::Vector3i& index) {
    points.push_back(grid.point(index));
  });
  std::vector<bool> anywhere;
  for (const float value : set.at(points)) anywhere.push_back(double{value} < level);
  CHECK(count_differing(found, anywhere) == 0);
  set.look_up(nullptr);
  CHECK(labels(set, grid, level) == right);
}

TEST_CASE("orbits that cannot be looked up closely enough, or at all, are computed") {
  const Device device = test::shared_device();
  const auto lookup = [&](const Map& map, double displacement) {
    const StopRadii stops = find_stop_radii(device, map);
    const surface::LevelSet set(device, map, stops, kIterations);
    const surface::Grid grid = surface::grid_around(surface::cube(1.5), 0.1, 0);
    return surface::make_lookup({device, map, stops, Precision::single}, set,
                                map.dynamics.surface_level, grid, displacement, {});
  };
  CHECK(lookup(modern_map(), 0.01));
  CHECK_FALSE(lookup(modern_map(), 1e-7));
  Map with_portal = modern_map();
  Portal portal;
  portal.center = {0, 0, 0.9};
  portal.radius = 0.1;
  with_portal.layers.portals.push_back(portal);
  CHECK_FALSE(lookup(with_portal, 0.01));
}

TEST_CASE("a surface by tables is closed, with as many bodies and nearly the same volume") {
  const Device device = test::shared_device();
  const Map map = modern_map();
  const StopRadii stops = find_stop_radii(device, map);
  SurfaceOptions options;
  options.resolution = 128;
  const auto surface = [&](surface::TableUse tables, MeshSink& sink) {
    return surface::level_set_surface(device, map, stops, options, sink, {}, tables);
  };
  MeshSink exact_sink, tabled_sink, small_sink;
  const SurfaceReport tabled = surface(surface::TableUse::always, tabled_sink);
  const SurfaceReport small = surface(surface::TableUse::where_they_pay, small_sink);
  options.exact = true;
  const SurfaceReport exact = surface(surface::TableUse::always, exact_sink);
  CHECK(tabled.trusted_share > 0.5);
  CHECK(exact.trusted_share == 0);
  CHECK(small.trusted_share == 0);
  CHECK(tabled.iterated < exact.iterated);
  CHECK(tabled.open_edges == 0);
  CHECK(inspect(tabled_sink.mesh).non_manifold_edges == 0);
  CHECK(tabled_sink.mesh.vertices != exact_sink.mesh.vertices);
  CHECK(small_sink.mesh.vertices == exact_sink.mesh.vertices);
  drop_loose_pieces(exact_sink.mesh);
  drop_loose_pieces(tabled_sink.mesh);
  const SurfaceFigures a = measure(exact_sink.mesh), b = measure(tabled_sink.mesh);
  CHECK(a.components == b.components);
  CHECK(b.volume == Catch::Approx(a.volume).epsilon(0.003));
  CHECK(b.area == Catch::Approx(a.area).epsilon(0.02));
}

TEST_CASE("tables pay in large grids of many factors") {
  Map map = modern_map();
  const auto pay = [&](int cells, std::size_t factors) {
    map.dynamics.factors.resize(factors, map.dynamics.factors.front());
    return surface::tables_pay(map, surface::grid_over(surface::cube(1), cells));
  };
  CHECK_FALSE(pay(256, 992));
  CHECK(pay(384, 992));
  CHECK_FALSE(pay(512, 331));
  CHECK(pay(1024, 331));
}
