// Porosity of bodies that are known, and the roughness of a map's set.

#include <catch2/catch_all.hpp>
#include <cmath>
#include <nlohmann/json.hpp>

#include "qjulia/base/error.hpp"
#include "qjulia/exact/exact_map.hpp"
#include "qjulia/surface/cell_mesh.hpp"
#include "qjulia/surface/figures.hpp"
#include "qjulia/surface/roughness.hpp"
#include "qjulia/surface/roughness_target.hpp"
#include "shapes.hpp"
#include "test_device.hpp"

using namespace qjulia;

namespace {

const Device& roughness_device() { return test::shared_device(); }

/// Two plates of 2 × 2 × 0.95 with a gap of 0.1 between them.
TriangleMesh plates() {
  return shapes::joined(shapes::box({-1, -1, -1}, {1, 1, -0.05}),
                        shapes::box({-1, -1, 0.05}, {1, 1, 1}));
}

Map rough_map() {
  TriangleMesh mesh = shapes::sphere(3);
  for (auto& x : mesh.vertices) x.z() *= 2.5;
  ExactMapOptions options;
  options.resolution = 48;
  options.detail = 0.02;
  return exact_map(roughness_device(), mesh, options);
}

}  // namespace

TEST_CASE("porosity is the share of the outline that is not filled") {
  CHECK(porosity(roughness_device(), shapes::sphere(4), 64).share < 0.003);
  CHECK(porosity(roughness_device(), shapes::box(), 64).share == Catch::Approx(0).margin(0.002));
  const Porosity gap = porosity(roughness_device(), plates(), 100);
  CHECK(gap.radius == Catch::Approx(0.1));
  // A ball of 0.1 sinks 0.0134 into the gap between edges 0.1 apart: a circular segment.
  const double gap_volume = 0.1 * 4 - 8 * 0.00091;
  CHECK(gap.share == Catch::Approx(gap_volume / (gap_volume + 7.6)).margin(0.002));
  CHECK(gap.outline_volume == Catch::Approx(gap_volume + 7.6).epsilon(0.01));
  // Plates that a ball fits between have an outline each.
  TriangleMesh apart = shapes::moved(plates(), 1, {0, 0, 0});
  for (auto& x : apart.vertices) x.z() *= std::abs(x.z()) < 0.5 ? 4 : 1;
  CHECK(porosity(roughness_device(), apart, 64).share < 0.01);
}

TEST_CASE("a rough set has more area for smaller cells, and a smooth one has not") {
  const Map map = rough_map();
  const Roughness rough = roughness(roughness_device(), map, {.resolution = 96});
  REQUIRE(rough.scales.size() == 3);
  CHECK(rough.scales.back().resolution == 96);
  CHECK(rough.scales[0].figures.area < rough.scales[1].figures.area);
  CHECK(rough.scales[1].figures.area < rough.scales[2].figures.area);
  CHECK(rough.area_slope > 0.02);
  CHECK(rough.porosity.share > 0.001);
  const Roughness smooth = roughness(roughness_device(), map, {.resolution = 96, .iterations = 1});
  CHECK(std::abs(smooth.area_slope) < 0.02);
  CHECK(to_json(rough).at("scales").size() == 3);
}

TEST_CASE("a map has the area, volume or dimension that is asked for") {
  const Map map = rough_map();
  const RoughnessOptions cells{.resolution = 64};
  const SurfaceFigures smooth = figures_of_set(roughness_device(), map, {64, 1});
  const TargetedMap by_area =
      with_roughness(roughness_device(), map, {.area = 1.25, .volume = 1, .resolution = 64});
  const SurfaceFigures reached = figures_of_set(roughness_device(), by_area.map, cells);
  CHECK(reached.area / smooth.area == Catch::Approx(1.25).epsilon(0.006));
  CHECK(reached.volume / smooth.volume == Catch::Approx(1).epsilon(0.006));
  CHECK(by_area.map.frame.detail == by_area.detail);
  const RoughnessReference mesh{0.5 * smooth.area, smooth.volume};
  const TargetedMap twice =
      with_roughness(roughness_device(), map, {.area = 2.5, .resolution = 64}, mesh);
  CHECK(twice.figures.area / smooth.area == Catch::Approx(1.25).epsilon(0.006));
  const TargetedMap by_dimension =
      with_roughness(roughness_device(), map, {.dimension = 2.1, .resolution = 64});
  CHECK(by_dimension.figures.dimension == Catch::Approx(2.1).margin(0.006));
}

TEST_CASE("what cannot be reached is said with what can be") {
  const Map map = rough_map();
  const auto why_not = [&](const RoughnessTarget& target) -> std::string {
    try {
      with_roughness(roughness_device(), map, target);
    } catch (const OptionError& error) {
      return error.field() + ": " + error.problem();
    }
    return "";
  };
  CHECK_THAT(why_not({.area = 90, .resolution = 64}),
             Catch::Matchers::StartsWith("target_area: 90 cannot be reached") &&
                 Catch::Matchers::ContainsSubstring("at most"));
  CHECK_THAT(why_not({.dimension = 1.5, .resolution = 64}),
             Catch::Matchers::ContainsSubstring("at least"));
  CHECK_THAT(why_not({.area = 1.2, .volume = 8, .resolution = 64}),
             Catch::Matchers::StartsWith("target_volume: 8 cannot be reached"));
  Map without = map;
  without.frame.detail.reset();
  CHECK_THROWS_AS(with_roughness(roughness_device(), without, {.area = 1.2, .resolution = 64}),
                  OptionError);
}

TEST_CASE("a mesh has the area that cells of each size see") {
  const TriangleMesh ball = shapes::sphere(5);
  const MeshScales smooth = mesh_scales(roughness_device(), ball, 128);
  REQUIRE(smooth.scales.size() == 4);
  for (const SurfaceAtScale& scale : smooth.scales) {
    CHECK(scale.figures.area == Catch::Approx(smooth.whole.area).epsilon(0.02));
    CHECK(scale.figures.volume == Catch::Approx(smooth.whole.volume).epsilon(0.02));
    CHECK(scale.figures.components == 1);
  }
  CHECK(std::abs(smooth.area_slope) < 0.01);
  // Waves that a cell of a 128th sees, and one of a 16th does not.
  TriangleMesh rough = shapes::sphere(7);
  for (Eigen::Vector3d& x : rough.vertices) {
    x *= 1 + 0.02 * std::sin(60 * x.x()) * std::sin(60 * x.y()) * std::sin(60 * x.z());
  }
  const MeshScales waves = mesh_scales(roughness_device(), rough, 128);
  CHECK(waves.scales.back().figures.area == Catch::Approx(waves.whole.area).epsilon(0.05));
  CHECK(waves.scales.front().figures.area < 0.9 * waves.whole.area);
  CHECK(waves.area_slope > 0.03);
  // Far blocks count as one side: the mesh is that of all points.
  const TriangleMesh seen = cell_mesh(roughness_device(), plates(), 40);
  CHECK(measure(seen).components == 2);
  CHECK(signed_volume(seen) == Catch::Approx(7.6).epsilon(0.02));
  CHECK(to_json(waves)["scales"][3]["area_ratio"] > 0.95);
}
