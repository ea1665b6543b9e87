// The way from one map to another, and what flickers on it.

#include <algorithm>
#include <catch2/catch_all.hpp>
#include <cmath>

#include "morph/matching.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/exact/exact_map.hpp"
#include "qjulia/fit/fit.hpp"
#include "qjulia/map/field.hpp"
#include "qjulia/morph/morph.hpp"
#include "qjulia/morph/versor_transfer.hpp"
#include "random_maps.hpp"
#include "shapes.hpp"
#include "test_device.hpp"

using namespace qjulia;

namespace {

const Device& morph_device() { return test::shared_device(); }

TriangleMesh ellipsoid(double x, double y, double z) {
  TriangleMesh mesh = shapes::sphere(3);
  for (auto& v : mesh.vertices) v = Eigen::Vector3d(x * v.x(), y * v.y(), z * v.z());
  return mesh;
}

Map fitted_to(const TriangleMesh& mesh, int factors) {
  FitOptions options;
  options.factors = factors;
  options.max_evaluations = 120;
  options.detail = 0.03;
  return fit(morph_device(), mesh, options).map;
}

/// Distances that the map holds, (F_1 − L) δ.
std::vector<double> distances_of(const Map& map, const std::vector<Quaternion>& points) {
  const double shell =
      *map.frame.detail * map.frame.shape_to_map.scale * map.frame.own_diagonal().value();
  std::vector<double> found = Field(morph_device(), map).at(points);
  for (double& f : found) f = shell * (f - map.dynamics.surface_level);
  return found;
}

std::vector<Quaternion> points_about() {
  std::mt19937_64 bits(7);
  std::vector<Quaternion> points;
  for (int i = 0; i < 4000; ++i) {
    points.push_back({test::uniform(bits, -1.6, 1.6), test::uniform(bits, -1.6, 1.6),
                      test::uniform(bits, -1.6, 1.6), 0});
  }
  return points;
}

/// The mean difference from (1 − t) a + t b where that is near 0, map units.
double distance_from_blend(const Map& map, const Map& a, const Map& b, double t) {
  const auto points = points_about();
  const auto of_map = distances_of(map, points), of_a = distances_of(a, points),
             of_b = distances_of(b, points);
  double sum = 0;
  int count = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double blend = (1 - t) * of_a[i] + t * of_b[i];
    if (std::abs(blend) > 0.1) continue;
    sum += std::abs(of_map[i] - blend);
    ++count;
  }
  REQUIRE(count > 100);
  return sum / count;
}

}  // namespace

TEST_CASE("factors are paired with near ones of like exponents, and the rest fade") {
  Dynamics from, to;
  from.slice = 0.1;
  from.factors = {{{0, 0, 0, 0.1}, 2}, {{1, 0, 0, 0.1}, 1}, {{0, 1, 0, 0.1}, -1}};
  to.factors = {{{0, 1.1, 0, 0}, -1.2},
                {{0.5, 0.5, 0.5, 0}, 0.3},
                {{0.1, 0, 0, 0}, 2.1},
                {{1, 0.1, 0, 0}, 0.9}};
  const morph::Matching found = morph::matched(from, to);
  CHECK(found.pairs.matched == 3);
  CHECK(found.pairs.appearing == 1);
  CHECK(found.pairs.vanishing == 0);
  REQUIRE(found.factors.size() == 4);
  // The product keeps the first map's order; the new factor follows the one it follows there.
  CHECK(found.factors[0].to.exponent == 2.1);
  CHECK(found.factors[1].to.exponent == 0.9);
  CHECK(found.factors[2].to.exponent == -1.2);
  CHECK(found.factors[3].to.exponent == 0.3);
  CHECK(found.factors[3].from.exponent == 0);
  CHECK(found.factors[3].from.center == to.factors[1].center);
  CHECK(found.factors[0].from.center == Quaternion{0, 0, 0, 0});
  const morph::Matching back = morph::matched(to, from);
  CHECK(back.pairs.vanishing == 1);
  CHECK(back.factors[1].to.exponent == 0);
  std::stop_source stopped;
  stopped.request_stop();
  CHECK_THROWS_AS(morph::matched(from, to, stopped.get_token()), Interrupted);
  to.factors.resize(kMostMorphFactors + 1);
  CHECK_THROWS_WITH(morph::matched(from, to),
                    Catch::Matchers::ContainsSubstring("has 4001 factors") &&
                        Catch::Matchers::ContainsSubstring("`factors_at_most`"));
}

TEST_CASE("a morph of fitted maps follows the blended potential from one shape to the other") {
  const Map a = fitted_to(ellipsoid(1, 0.6, 0.6), 40), b = fitted_to(ellipsoid(0.6, 0.6, 1), 32);
  const Morph morph(morph_device(), a, b);
  CHECK(morph.pairs().matched == b.dynamics.factors.size());
  CHECK(morph.pairs().vanishing == a.dynamics.factors.size() - b.dynamics.factors.size());
  const Map first = morph.at(0), last = morph.at(1);
  REQUIRE(first.dynamics.factors.size() == a.dynamics.factors.size());
  for (std::size_t k = 0; k < a.dynamics.factors.size(); ++k) {
    CHECK(first.dynamics.factors[k].exponent ==
          Catch::Approx(a.dynamics.factors[k].exponent).margin(1e-9));
    CHECK(norm(first.dynamics.factors[k].center - a.dynamics.factors[k].center) < 1e-12);
  }
  CHECK(distance_from_blend(first, a, b, 0) < 1e-4);
  CHECK(distance_from_blend(last, a, b, 1) < 1e-4);
  CHECK(distance_from_blend(morph.at(0.5), a, b, 0.5) < 0.016);
  CHECK(distance_from_blend(morph.at(0.5), a, b, 0.4) > 0.016);  // the check can fail
  const Map before = morph.at(0.3), after = morph.at(0.3001);
  double largest = 0;
  for (std::size_t k = 0; k < before.dynamics.factors.size(); ++k) {
    largest = std::max(largest, std::abs(after.dynamics.factors[k].exponent -
                                         before.dynamics.factors[k].exponent));
  }
  CHECK(largest < 0.01);
}

TEST_CASE("a morph of exact maps blends their distances") {
  ExactMapOptions options;
  options.resolution = 64;
  options.detail = 0.02;
  const Map a = exact_map(morph_device(), ellipsoid(1, 0.6, 0.6), options);
  options.versor = RandomRoots{40, 2};
  const Map b = exact_map(morph_device(), ellipsoid(0.7, 1, 0.5), options);
  const Morph morph(morph_device(), a, b);
  CHECK(morph.pairs().matched == 40);
  CHECK(morph.pairs().vanishing == 20);
  CHECK(distance_from_blend(morph.at(0), a, b, 0) < 0.003);
  CHECK(distance_from_blend(morph.at(0.5), a, b, 0.5) < 0.003);
  CHECK(distance_from_blend(morph.at(1), a, b, 1) < 0.003);
  Map sliced = a;
  sliced.dynamics.slice = 0.4;  // it is applied once
  CHECK(distance_from_blend(Morph(morph_device(), sliced, b).at(0), a, b, 0) < 0.003);
  const Map fitted = test::random_map(12, 0.001, 0.6, 5);
  CHECK_THROWS_AS(Morph(morph_device(), a, fitted), InputError);
  FlickerMeter meter(morph_device(), morph.box(), 24);
  for (int step = 0; step < 12; ++step) meter.add(morph.at(step / 11.0));
  const Flicker flicker = meter.flicker();
  CHECK(flicker.steps == 9);
  CHECK(flicker.changed > 0.001);
  CHECK(flicker.mean < 0.005);
}

TEST_CASE("a map takes the grooves of another, as much larger as its inradius is") {
  ExactMapOptions options;
  options.resolution = 64;
  const Map thin = exact_map(morph_device(), ellipsoid(1, 0.3, 0.3), options);
  options.versor = RandomRoots{20, 3};
  options.phase = {0.6, 0.8, 0, 0};
  const Map round = exact_map(morph_device(), ellipsoid(1, 0.9, 0.8), options);
  const auto inradius = [](const Map& map) {
    return *map.frame.inradius * map.frame.shape_to_map.scale;
  };
  const double enlarged = inradius(thin) / inradius(round);
  CHECK(enlarged < 0.5);
  const std::vector<Quaternion> points = points_about();
  std::vector<Quaternion> scaled;
  for (const Quaternion& q : points) scaled.push_back(enlarged * q);
  const auto expect_versor = [&](const Map& result, const Map& grooves) {
    const auto wanted = Field(morph_device(), grooves).versors_at(points);
    const auto found = Field(morph_device(), result).versors_at(scaled);
    std::size_t different = 0;  // at branch cuts, by rounding
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (norm(found[i] - wanted[i]) > 0.01) ++different;
    }
    CHECK(different < points.size() / 100);
  };
  const Map result = with_versor_of(morph_device(), thin, round);
  CHECK(result.dynamics.modulus == thin.dynamics.modulus);
  expect_versor(result, round);

  options.versor = NoiseVersor{};
  const Map noisy = exact_map(morph_device(), ellipsoid(1, 0.9, 0.8), options);
  const Map with_noise = with_versor_of(morph_device(), thin, noisy);
  CHECK(with_noise.dynamics.kind() == "distance/noise");
  expect_versor(with_noise, noisy);

  // A fitted map keeps its shape, on a grid.
  const Map fitted = fitted_to(ellipsoid(1, 0.6, 0.6), 24);
  const Map transferred = with_versor_of(morph_device(), fitted, round, 64);
  CHECK(transferred.dynamics.kind() == "distance/factors");
  CHECK(distance_from_blend(transferred, fitted, fitted, 0) < 0.004);
  CHECK(with_versor_of(morph_device(), fitted, noisy).dynamics.kind() == "factors/noise");
}

TEST_CASE("cells that change and change back flicker, and others do not") {
  ExactMapOptions options;
  options.resolution = 48;
  const Map small = exact_map(morph_device(), ellipsoid(1, 0.6, 0.6), options);
  Map large = small;
  large.dynamics.log_scale -= 2;
  const Box box{{-2, -2, -2}, {2, 2, 2}};
  const auto flicker_of = [&](const std::vector<const Map*>& maps) {
    FlickerMeter meter(morph_device(), box, 24, 1);
    for (const Map* map : maps) meter.add(*map);
    return meter.flicker();
  };
  const Flicker flash = flicker_of({&small, &large, &small, &small});
  CHECK(flash.steps == 1);
  CHECK(flash.mean > 0.005);
  CHECK(flash.mean == flash.changed);
  CHECK(flicker_of({&small, &large, &large, &small}).mean == flash.mean);
  const Flicker stays = flicker_of({&small, &large, &large, &large});
  CHECK(stays.mean == 0);
  CHECK(stays.changed == flash.changed);
  CHECK(flicker_of({&small, &large, &small}).steps == 0);
}
