// What pages look up over the ranges of knobs, against what is measured there, between the nodes.

#include <catch2/catch_all.hpp>
#include <cmath>
#include <filesystem>

#include "explore/scene_table.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/exact/exact_map.hpp"
#include "qjulia/map/field.hpp"
#include "qjulia/map/knobs.hpp"
#include "qjulia/map/map_file.hpp"
#include "qjulia/map/slope.hpp"
#include "random_maps.hpp"
#include "shapes.hpp"
#include "test_device.hpp"

using namespace qjulia;

namespace {

Map bunny() {
  const std::filesystem::path file(__FILE__);
  return read_map(file.parent_path() / "../../docs/maps/bunny.qjulia.json");
}

/// A knob's value that is no node, evenly over the cells.
double between_nodes(const explore::KnobNodes& knob, std::mt19937_64& bits) {
  const double at = test::uniform(bits, 0, static_cast<double>(knob.cells()));
  const auto cell = static_cast<std::size_t>(at);
  return std::lerp(knob.nodes[cell], knob.nodes[cell + 1], at - std::floor(at));
}

/// Settings of the four knobs, and the slice.
struct Turned {
  double detail, drift, scale, steepness, slice;
};

Turned some_knobs(const explore::SceneTable& table, std::mt19937_64& bits) {
  std::array<double, 4> values{};
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = between_nodes(table.knobs[i], bits);
  }
  return {values[0], values[1], values[2], values[3], between_nodes(table.slices, bits)};
}

Map with(const Map& map, const Turned& turned) {
  MapKnobs knobs;
  if (map.frame.detail) knobs.detail = turned.detail;
  if (turned.drift > 0) knobs.drift = turned.drift;
  knobs.scale = turned.scale;
  knobs.steepness = turned.steepness;
  knobs.slice = turned.slice;
  return with_knobs(test::shared_device(), map, knobs);
}

double level_at(const explore::SceneTable& table, double drift) {
  std::size_t i = 1;
  while (i + 1 < table.drifts.size() && table.drifts[i] < drift) ++i;
  if (table.drifts.size() == 1) return table.levels.front();
  const double way = (drift - table.drifts[i - 1]) / (table.drifts[i] - table.drifts[i - 1]);
  return std::lerp(table.levels[i - 1], table.levels[i], way);
}

Map exact_torus() {
  ExactMapOptions options;
  options.resolution = 48;
  return exact_map(test::shared_device(), shapes::torus(), options);
}

constexpr double kFar = 1e9;

Quaternion some_direction(std::mt19937_64& bits) {
  for (;;) {
    const double w = test::uniform(bits, -1, 1), z = test::uniform(bits, -1, 1);
    const double y = test::uniform(bits, -1, 1);
    const Quaternion q{test::uniform(bits, -1, 1), y, z, w};
    if (const double size = norm(q); size > 0.1 && size < 1) return (1 / size) * q;
  }
}

}  // namespace

TEST_CASE("what pages look up holds between the nodes") {
  const Device& device = test::shared_device();
  const Map map = GENERATE(0, 1) == 0 ? bunny() : exact_torus();
  const explore::SceneTable table = explore::scene_table(device, map);
  REQUIRE(table.knobs[1].nodes.back() > 0.5);
  std::mt19937_64 bits(7);
  int tight = 0;
  constexpr int kSettings = 16;
  for (int i = 0; i < kSettings; ++i) {
    const Turned turned = some_knobs(table, bits);
    CAPTURE(map.dynamics.kind(), turned.detail, turned.drift, turned.scale, turned.steepness,
            turned.slice);
    const Map wanted = with(map, turned);
    const auto& entry = table.entry_at(turned.detail, turned.drift, turned.scale, turned.steepness);
    CHECK(std::abs(level_at(table, turned.drift) - wanted.dynamics.surface_level) <
          explore::SceneTable::kLevelError);

    // Beyond r_out points go out, and within r_in they go in.
    const double inner = table.inner[entry.inner], level = wanted.dynamics.surface_level;
    const auto [outer, escape] = table.outer[entry.outer];
    CHECK(inner < std::exp(level));
    CHECK(outer > std::exp(level));
    CHECK(escape >= 1.2 * outer);
    const Field field(device, wanted, Precision::single, {0, 0, kFar});
    std::vector<Quaternion> points;
    std::vector<double> logs;
    for (int k = 0; k < 20000; ++k) {
      const Quaternion direction = some_direction(bits);
      const bool is_inner = k % 2 == 0 && inner > 0;
      const double radius = is_inner ? inner * std::pow(test::uniform(bits, 0, 1), 0.25)
                                     : outer * (1 + 2 * std::pow(test::uniform(bits, 0, 1), 4));
      points.push_back(radius * direction);
      logs.push_back(is_inner ? std::log(inner) : std::log(radius));
    }
    const std::vector<double> values = field.at(points);
    std::size_t wrong = 0;
    for (std::size_t k = 0; k < points.size(); ++k) {
      const bool is_inner = k % 2 == 0 && inner > 0;
      if (is_inner ? values[k] > logs[k] : values[k] < logs[k]) ++wrong;
    }
    CHECK(wrong == 0);
    const StopRadii stops = find_stop_radii(device, wanted);
    CHECK(inner < 1.02 * stops.inner + 1e-9);
    CHECK(outer < 1.5 * stops.outer);
    if (inner >= 0.6 * stops.inner) ++tight;

    // Slopes are percentiles of scattered points: those of a box and of a slice differ.
    const std::size_t slice = table.slices.cell_of(turned.slice);
    const Box& box = table.boxes[slice][entry.band];
    const double per_slope = turned.steepness * map.frame.detail.value_or(1) / turned.detail;
    const auto at_far = steepest_slope(field, turned.slice, std::log(std::min(outer, escape)), box);
    if (at_far) CHECK(per_slope * table.slopes[slice][entry.slope] > 0.8 * *at_far);
    const auto at_level = steepest_slope(field, turned.slice, level, box);
    if (at_level) CHECK(per_slope * table.slopes[slice][entry.single_slope] > 0.8 * *at_level);

    // Whatever is inside, or near it, lies in the box.
    std::vector<Quaternion> scattered;
    for (int k = 0; k < 20000; ++k) {
      const double z = test::uniform(bits, -3, 3), y = test::uniform(bits, -3, 3);
      scattered.push_back({test::uniform(bits, -3, 3), y, z, turned.slice});
    }
    const std::vector<double> above = field.at(scattered);
    // Boxes lie in the file's coordinates.
    const Eigen::Vector3d moved =
        wanted.frame.shape_to_map.translation - map.frame.shape_to_map.translation;
    std::size_t outside = 0;
    for (std::size_t k = 0; k < scattered.size(); ++k) {
      const Eigen::Vector3d p =
          Eigen::Vector3d(scattered[k].x, scattered[k].y, scattered[k].z) - moved;
      const bool is_in =
          (p.array() >= box.low.array()).all() && (p.array() <= box.high.array()).all();
      if (above[k] < level && !is_in) ++outside;
    }
    CHECK(outside == 0);
  }
  CHECK(tight >= kSettings / 2);
}

TEST_CASE("a cell of a knob's range holds its values") {
  const explore::KnobNodes knob{"scale", {1, 2, 4, 8}};
  CHECK(knob.cells() == 3);
  for (const auto& [value, cell] :
       {std::pair{0.5, 0}, {1.0, 0}, {1.9, 0}, {2.0, 1}, {3.9, 1}, {4.0, 2}, {8.0, 2}, {9.0, 2}}) {
    CAPTURE(value);
    CHECK(knob.cell_of(value) == static_cast<std::size_t>(cell));
  }
}

TEST_CASE("maps that bear fewer knobs have tables") {
  // A ball of radius e^L about the origin: no detail, no drift.
  Map map;
  map.dynamics.modulus = QuadraticModulus{{-0.2, 0.3, 0, 0}};
  map.dynamics.versor = QuadraticVersor{{-0.2, 0.3, 0, 0}};
  map.dynamics.surface_level = std::log(2);
  const explore::SceneTable table = explore::scene_table(test::shared_device(), map);
  CHECK(table.knobs[0].cells() == 1);
  CHECK(table.knobs[1].cells() == 1);
  CHECK(table.drifts == std::vector<double>{0});
  const auto& entry = table.entry_at(1, 0, 1, 1);
  CHECK(table.outer[entry.outer].outer < 3);
}
