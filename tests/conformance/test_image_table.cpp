// Tables of images, against the reference.

#include <algorithm>
#include <catch2/catch_all.hpp>
#include <cmath>

#include "armed_ball.hpp"
#include "base/random.hpp"
#include "check/unit_ball.hpp"
#include "lattice/image_probe.hpp"
#include "lattice/image_table.hpp"
#include "layout/image_table.h"
#include "map/device_map.hpp"
#include "map/reference_iteration.hpp"
#include "picture/depth_source.hpp"
#include "picture/view.hpp"
#include "qjulia/map/detail.hpp"
#include "qjulia/map/field.hpp"
#include "qjulia/map/knobs.hpp"
#include "qjulia/map/map_file.hpp"
#include "test_device.hpp"

using namespace qjulia;

namespace {

/// A displacement, map units, for which no table is too fine.
constexpr double kFinest = 1e-7;

Map wild_map() { return calibrated(test::shared_device(), steepened(test::armed_ball_map(60), 8)); }

/// Points as kernels take them.
struct Points {
  std::vector<Quaternion> points;
  std::vector<double> arrays;
};

/// In [-reach, reach]^4, every other one close to the origin.
Points random_points(std::size_t count, double reach) {
  base::Random random(11);
  Points made{{}, std::vector<double>(4 * count)};
  for (std::size_t i = 0; i < count; ++i) {
    const double within = i % 2 == 0 ? reach : 0.1 * reach;
    for (std::size_t c = 0; c < 4; ++c)
      made.arrays[c * count + i] = random.uniform(-within, within);
    made.points.push_back({made.arrays[i], made.arrays[count + i], made.arrays[2 * count + i],
                           made.arrays[3 * count + i]});
  }
  return made;
}

/// Runs a kernel of image_table.cl on points. @param outputs arrays that it makes.
std::vector<double> run(const map::DeviceMap& map, const char* name, const Points& points,
                        const std::vector<device::Argument>& more, std::size_t outputs) {
  device::Context& context = map.context();
  const std::size_t count = points.points.size(), groups = count / map.lanes();
  const auto out = context.allocate_real(outputs * count, map.precision());
  const auto in = context.upload_real(points.arrays, map.precision());
  std::vector<device::Argument> list = {in, device::narrow(count), device::narrow(groups)};
  for (const device::Argument& argument : more) list.push_back(argument);
  list.emplace_back(out);
  context.launch(map.kernel("image_table.cl", name), {{groups, 1, 1}}, list, device::kNotCounted);
  std::vector<double> found(outputs * count);
  context.read(out, found);
  return found;
}

}  // namespace

TEST_CASE("bounds over cubes of four dimensions hold at every point of them") {
  const Map map = wild_map();
  const int width = GENERATE(from_range(test::lane_widths()));
  const map::DeviceMap device_map(test::shared_device().with_lane_width(width), map, {},
                                  Precision::single);
  const Points middles = random_points(64, 2);
  const double half_side = GENERATE(0.02, 0.14, 0.5);
  CAPTURE(width, half_side);
  const auto bounds =
      run(device_map, "cube_bounds", middles,
          {device_map.real(half_side), device_map.buffer(), device_map.factors()}, 2);
  base::Random random(3);
  double slack = 0;
  for (std::size_t i = 0; i < 64; ++i) {
    double least = 1e30, most = -1e30;
    for (int k = 0; k < 200; ++k) {
      Quaternion q = middles.points[i];
      for (double* c : {&q.x, &q.y, &q.z, &q.w}) *c += random.uniform(-half_side, half_side);
      const double f = reference::step(map, q).log_norm;
      least = std::min(least, f), most = std::max(most, f);
    }
    CHECK(bounds[i] <= least);
    CHECK(bounds[64 + i] >= most);
    slack += bounds[64 + i] - bounds[i] - (most - least);
  }
  if (half_side < 0.1) CHECK(slack / 64 < 1);  // they are of some use
}

TEST_CASE("a table says where images are, and what lies inside and outside for certain") {
  const bool is_ball = GENERATE(false, true);
  const Map map = is_ball ? check::unit_ball() : wild_map();
  const int width = GENERATE(from_range(test::lane_widths()));
  CAPTURE(width, is_ball);
  const Device device = test::shared_device().with_lane_width(width);
  const map::DeviceMap device_map(device, map, find_stop_radii(device, map), Precision::single);
  const auto table = surface::ImageTable::of_ball(device_map, kFinest, {});
  REQUIRE(!table.is_empty());
  std::vector<double> layout(QJ_TABLE_SIZE);
  device.context().read(table.layout(), layout);
  std::vector<std::int32_t> bricks(table.bricks().size());
  device.context().read(table.bricks(), std::span(bricks));

  const std::size_t count = 4096;
  const Points points = random_points(count, std::min(1.4, std::exp(device_map.log_outer())));
  const auto images = run(device_map, "table_images", points,
                          {table.layout(), table.bricks(), table.fields(), table.versors()}, 5);
  const int side = static_cast<int>(layout[QJ_TABLE_BRICKS]);
  std::vector<double> field_errors, versor_errors;
  std::size_t inside = 0, outside = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const Quaternion& q = points.points[i];
    int brick = 0;
    for (const double c : {q.w, q.z, q.y, q.x}) {
      brick = brick * side + static_cast<int>((c - layout[QJ_TABLE_ORIGIN]) /
                                              (QJ_TABLE_CELLS * layout[QJ_TABLE_STEP]));
    }
    const std::int32_t state = bricks.at(static_cast<std::size_t>(brick));
    const auto right = reference::step(map, q);
    if (state == QJ_TABLE_INSIDE) {
      ++inside;
      CHECK(right.log_norm < device_map.log_inner());
    } else if (state < 0) {
      ++outside;
      CHECK(right.log_norm > images[i] - 1e-4);
      CHECK(images[i] >= device_map.log_outer() - 1e-4);
    } else if (right.log_norm > device_map.log_inner() && right.log_norm < device_map.log_outer()) {
      field_errors.push_back(std::abs(images[i] - right.log_norm));
      versor_errors.push_back(norm(Quaternion{images[count + i], images[2 * count + i],
                                              images[3 * count + i], images[4 * count + i]} -
                                   right.versor));
    }
  }
  CHECK(outside > 0);
  if (is_ball) {
    CHECK(inside > 0);
    return;
  }
  REQUIRE(field_errors.size() > 50);
  std::ranges::sort(field_errors);
  std::ranges::sort(versor_errors);
  CHECK(field_errors[field_errors.size() / 2] < 0.1);
  CHECK(table.margin() > field_errors[field_errors.size() / 2]);
  CHECK(table.margin() >= field_errors[field_errors.size() * 99 / 100]);
  CHECK(versor_errors[versor_errors.size() / 2] < 0.35);
}

TEST_CASE("a table is as fine as it has to be") {
  const Device device = test::shared_device();
  const Map map = wild_map();
  const map::DeviceMap device_map(device, map, find_stop_radii(device, map), Precision::single);
  const auto finest = surface::ImageTable::of_ball(device_map, kFinest, {});
  CHECK(finest.is_finest());
  CHECK(finest.first_iterate(kFinest) > 2);
  double least = kFinest;
  while (finest.first_iterate(least) > 2) least *= 1.1;
  std::size_t bytes = finest.fields().bytes();
  for (const double displacement : {1.5 * least, 4 * least, 20 * least}) {
    const auto table = surface::ImageTable::of_ball(device_map, displacement, {});
    CAPTURE(displacement, least);
    CHECK(table.first_iterate(displacement) == 2);
    CHECK(table.fields().bytes() <= bytes);
    bytes = table.fields().bytes();
  }
  CHECK(bytes < finest.fields().bytes());
}

TEST_CASE(
    "where images move no farther than points, the first iterate of use is sought to an end") {
  const Device device = test::shared_device();
  MapKnobs knobs;
  knobs.drift = 0.7435;
  const Map bunny = read_map(QJULIA_TEST_DATA "/../../docs/maps/bunny.qjulia.json");
  const Map map = with_knobs(device, bunny, knobs);
  const map::DeviceMap device_map(device, map, find_stop_radii(device, map), Precision::single);
  const auto table = surface::ImageTable::of_ball(device_map, 0.01, {});
  REQUIRE(table.stretch() == 1);
  CHECK(table.first_iterate(0) > kMostIterations);
}

TEST_CASE("how far first images move is measured") {
  // q² moves images 2 |q| times as far as points, along q, and as far or less across.
  const Device device = test::shared_device();
  const Map map = check::unit_ball();
  const StopRadii stops{.inner = 0.7, .outer = 1.4};
  const map::DeviceMap device_map(device, map, stops, Precision::single);
  const double stretch = surface::first_stretch(device_map, {});
  CHECK(stretch > 1.4);
  CHECK(stretch < 2.8);
}

TEST_CASE(
    "a picture by a table is that without, but for what a shift of an eighth of a pixel does") {
  const Map map = wild_map();
  picture::MarchedSet set{map, 6, {}, {}, Precision::single};
  const Device device = test::shared_device();
  const auto exact = [&] {
    picture::MarchedSet plain = set;
    plain.interpolates_images = false;
    return picture::march_source(device, plain);
  }();
  const auto source = picture::march_source(device, set);
  // So many rays are to come that a table pays.
  source->prepare(picture::camera_view({}, *map.frame.box, 1200, 900, 1));
  const picture::View view = picture::camera_view({}, *map.frame.box, 120, 90, 1);
  const auto found = source->depths(view, 0, view.rows), right = exact->depths(view, 0, view.rows);
  std::size_t both = 0, one = 0, far = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const bool here = found[i] >= 0, there = right[i] >= 0;
    if (here != there) ++one;
    if (!here || !there) continue;
    ++both;
    if (std::abs(found[i] - right[i]) > view.footprint) ++far;
  }
  CHECK(both > 1000);
  CHECK(one <= both / 200);
  CHECK(far <= both / 25);
  CHECK(found != right);  // or else no table was used
}
