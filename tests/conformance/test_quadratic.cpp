// The quadratic map q² + c, through everything that iterates maps.

#include <catch2/catch_all.hpp>
#include <cmath>

#include "map/reference_iteration.hpp"
#include "map_checks.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/map/field.hpp"
#include "qjulia/map/knobs.hpp"
#include "qjulia/picture/picture.hpp"
#include "qjulia/surface/surface.hpp"
#include "random_maps.hpp"
#include "test_device.hpp"

using namespace qjulia;

namespace {

/// Not symmetric in any way.
Map some_map() {
  Map map = quadratic_map({0.285, 0.485, -0.1, 0.07});
  map.dynamics.log_scale = 0.1;
  map.dynamics.slice = 0.05;
  map.dynamics.phase = {0.8, 0, 0.6, 0};
  return map;
}

std::vector<Quaternion> some_points() { return test::random_points(3, 200, 1.2, 0.2); }

const Device& quadratic_device() { return test::shared_device(); }

}  // namespace

TEST_CASE("the reference iterates q² + c") {
  const Quaternion c{0.285, 0.485, 0, 0};
  const Quaternion q{0.3, -0.4, 0.5, 0.2};
  const Quaternion once = q * q + c;
  const Quaternion twice = once * once + c;
  const Map map = quadratic_map(c);
  CHECK(reference::field(map, std::vector{q}, 1, 20)[0] == Catch::Approx(std::log(norm(once))));
  CHECK(reference::field(map, std::vector{q}, 2, 20)[0] == Catch::Approx(std::log(norm(twice))));
  // e^S and the phase stand in front.
  Map turned = map;
  turned.dynamics.log_scale = std::log(0.5);
  turned.dynamics.phase = {0, 0, 1, 0};
  const Quaternion step = 0.5 * (Quaternion{0, 0, 1, 0} * once);
  const Quaternion next = 0.5 * (Quaternion{0, 0, 1, 0} * (step * step + c));
  CHECK(reference::field(turned, std::vector{q}, 2, 20)[0] == Catch::Approx(std::log(norm(next))));
}

TEST_CASE("its radii decide no orbit wrongly") {
  const Map map = some_map();
  const StopRadii stops = find_stop_radii(quadratic_device(), map);
  // e^S (r² − |c|) = r.
  const double r = stops.outer;
  CHECK(std::exp(map.dynamics.log_scale) *
            (r * r - norm(std::get<QuadraticModulus>(map.dynamics.modulus).c)) ==
        Catch::Approx(r));
  CHECK(stops.escape == Catch::Approx(1.25 * r));
  const auto points = some_points();
  const Field field(quadratic_device(), map, Precision::single, stops);
  const auto plain = reference::field(map, points, 12, 20);
  const auto decided = field.decided_at(points, 12);
  for (std::size_t i = 0; i < points.size(); ++i) {
    CHECK((plain[i] < std::log(r)) == (decided[i] < std::log(r)));
  }
}

TEST_CASE("q² has the unit ball for its set, in surfaces and pictures") {
  Map map = quadratic_map({});
  map.frame.shape_to_map = {2, {0.5, 0, 0}};
  SurfaceOptions options;
  options.resolution = 32;
  options.iterations = 8;
  const TriangleMesh mesh = extract_surface(quadratic_device(), map, options);
  REQUIRE(mesh.triangles.size() > 500);
  for (const Eigen::Vector3d& vertex : mesh.vertices) {
    CHECK((vertex - Eigen::Vector3d(-0.25, 0, 0)).norm() == Catch::Approx(0.5).margin(0.02));
  }
  PictureOptions picture;
  picture.width = picture.height = 32;
  picture.samples = 1;
  map.frame.box = Box{{-0.75, -0.5, -0.5}, {0.25, 0.5, 0.5}};
  const Image ball = render(quadratic_device(), map, picture);
  Map same;
  same.dynamics.factors = {{{}, 2}};  // q² as a rational map
  same.frame.shape_to_map = map.frame.shape_to_map;
  same.frame.box = map.frame.box;
  const Image expected = render(quadratic_device(), same, picture);
  REQUIRE(ball.pixels.size() == expected.pixels.size());
  int different = 0;
  for (std::size_t i = 0; i < ball.pixels.size(); ++i) {
    if (std::abs(int{ball.pixels[i]} - int{expected.pixels[i]}) > 8) ++different;
  }
  CHECK(different < 60);  // of 3072, at the rim
}

TEST_CASE("knobs of factors are refused, the others turn it") {
  const Map map = some_map();
  const auto refused = [&](auto change, const std::string& option) {
    MapKnobs knobs;
    change(knobs);
    CHECK_THROWS_WITH(with_knobs(quadratic_device(), map, knobs),
                      Catch::Matchers::ContainsSubstring(option));
  };
  refused([](MapKnobs& k) { k.detail = 0.01; }, "detail");
  refused([](MapKnobs& k) { k.order_seed = 1; }, "order_seed");
  refused([](MapKnobs& k) { k.drift = 0.1; }, "drift");
  refused([](MapKnobs& k) { k.translate = Eigen::Vector3d(1, 0, 0); }, "translate");
  MapKnobs knobs;
  knobs.scale = 2;
  knobs.slice = 0.3;
  const Map other = with_knobs(quadratic_device(), map, knobs);
  CHECK(other.dynamics.log_scale == Catch::Approx(map.dynamics.log_scale - std::log(2)));
  CHECK(other.dynamics.slice == 0.3);
}
