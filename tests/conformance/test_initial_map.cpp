// Fits that start from a map.

#include <catch2/catch_all.hpp>
#include <cmath>
#include <nlohmann/json.hpp>

#include "fit/initial_map.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/fit/fit.hpp"
#include "qjulia/map/field.hpp"
#include "qjulia/map/map_file.hpp"
#include "random_maps.hpp"
#include "shapes.hpp"
#include "test_device.hpp"

using namespace qjulia;
using Eigen::Vector3d;

namespace {

FitOptions short_fit(int evaluations) {
  FitOptions options;
  options.factors = 24;
  options.schedule = "fast";
  options.max_evaluations = evaluations;
  return options;
}

/// IoU of the map that a fit of the mesh starts from.
double first_iou(const TriangleMesh& mesh, FitOptions options) {
  double iou = -1;
  options.observer.on_stage = [&](const StageReport& stage, const Map&) {
    if (iou < 0) iou = stage.iou;
  };
  fit(test::shared_device(), mesh, options);
  return iou;
}

}  // namespace

TEST_CASE(
    "a map to start from has the distance's slope and the field it had, in the shape's frame") {
  if (!test::can_check(test::shared_device(), Precision::dbl)) return;
  const Shape shape = make_shape(test::shared_device(), shapes::torus(1, 0.4));
  fitting::SamplePool pool;
  pool.surface = sample_surface(shape.mesh, 400, 3);
  Map given = test::random_map(15, 0.5, 2, 91);
  given.dynamics.slice = 0.2;
  given.dynamics.surface_level = -0.7;
  given.dynamics.phase = {0.6, 0, 0.8, 0};
  given.layers.steepness = 3;
  given.frame.shape_to_map = {2.5, {0.3, -0.2, 0.1}};
  const Map map = fitting::started_from(test::shared_device(), given, shape, pool);
  CHECK(map.layers.steepness == 1);
  CHECK(map.dynamics.slice == 0);
  CHECK(map.dynamics.surface_level == 0);
  CHECK(map.dynamics.phase == given.dynamics.phase);
  Map plain = given;
  plain.layers = {};
  std::vector<Vector3d> places, old_places;
  for (int i = 0; i < 40; ++i) {
    const Vector3d x(0.05 * i - 1, std::sin(i), 0.5 * std::cos(2 * i));
    places.push_back(shape.shape_to_map.to_map(x));
    old_places.push_back(given.frame.shape_to_map.to_map(x));
  }
  const auto found = Field(test::shared_device(), map, Precision::dbl).at(on_slice(places, 0));
  const auto before =
      Field(test::shared_device(), plain, Precision::dbl).at(on_slice(old_places, 0.2));
  const double unit = map.dynamics.factors[0].exponent / given.dynamics.factors[0].exponent;
  for (std::size_t i = 0; i < found.size(); ++i) {
    CHECK(found[i] == Catch::Approx(unit * (before[i] + 0.7)).margin(1e-9));
  }
  double slope = 0;
  for (const SurfacePoint& p : pool.surface) {
    const auto g = Field(test::shared_device(), map)
                       .gradient_at(on_slice(std::vector<Vector3d>{p.position}, 0));
    slope += std::hypot(g[0].x, g[0].y, g[0].z) / static_cast<double>(pool.surface.size());
  }
  CHECK(slope == Catch::Approx(1).epsilon(1e-4));
  for (Factor& factor : given.dynamics.factors) factor.exponent = 0;
  CHECK_THROWS_AS(fitting::started_from(test::shared_device(), given, shape, pool), OptionError);
}

TEST_CASE("a fit that starts from a fitted map begins where that ended, wherever the shape lies") {
  const TriangleMesh mesh = shapes::torus(1, 0.4);
  const FitResult fitted = fit(test::shared_device(), mesh, short_fit(120));
  FitOptions options = short_fit(5);
  const double placed = first_iou(mesh, options);
  options.initial = fitted.map;
  const double started = first_iou(mesh, options);
  CHECK(fitted.stages.back().iou > placed + 0.05);
  CHECK(started == Catch::Approx(fitted.stages.back().iou).margin(0.02));
  // The same shape in other units.
  const Vector3d move(10, -20, 5);
  ShapeToMap& frame = options.initial->frame.shape_to_map;
  frame = {frame.scale / 7, frame.translation - frame.scale / 7 * move};
  CHECK(first_iou(shapes::moved(mesh, 7, move), options) == Catch::Approx(started).margin(0.02));
}

TEST_CASE("a schedule given as text is the one of that text") {
  const TriangleMesh mesh = shapes::sphere(2);
  const FitOptions named = short_fit(20);
  FitOptions given = named;
  given.schedule = "tight";
  given.schedule_text = schedule_text("fast");
  const auto map_of = [&](const FitOptions& options) {
    return to_json(fit(test::shared_device(), mesh, options).map).dump();
  };
  CHECK(map_of(given) == map_of(named));
  given.schedule_text = schedule_text("paper");
  CHECK(map_of(given) != map_of(named));
}
