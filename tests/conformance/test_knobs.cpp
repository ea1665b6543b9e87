// What each knob must leave as it is.

#include <Eigen/Geometry>
#include <algorithm>
#include <catch2/catch_all.hpp>
#include <cmath>
#include <numbers>
#include <set>

#include "map/reference_iteration.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/exact/exact_map.hpp"
#include "qjulia/map/field.hpp"
#include "qjulia/map/knob_table.hpp"
#include "qjulia/map/knobs.hpp"
#include "qjulia/picture/picture_settings.hpp"
#include "random_maps.hpp"
#include "shapes.hpp"
#include "test_device.hpp"

using namespace qjulia;

namespace {

Map some_map() {
  Map map = test::random_map(24, 0.1, 0.6, 4);
  map.dynamics.factors.push_back({{0, 0, 0, 0.1}, 3});
  map.frame.shape_to_map = {1.5, {0.1, -0.2, 0.3}};
  map.frame.detail = 0.02;
  map.frame.inradius = 0.4;
  map.frame.box = Box{{-1, -1, -1}, {1, 1, 1}};
  return map;
}

/// F_1 − L at points of the shape's own coordinates.
std::vector<double> above_level(const Map& map) {
  std::mt19937_64 bits(6);
  std::vector<Quaternion> points;
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d x = map.frame.shape_to_map.to_map(
        {test::uniform(bits, -1, 1), test::uniform(bits, -1, 1), test::uniform(bits, -1, 1)});
    points.push_back({x.x(), x.y(), x.z(), map.dynamics.slice});
  }
  auto field = reference::field(map, points, 1, 1e6);
  for (double& f : field) f -= map.dynamics.surface_level;
  return field;
}

/// The potential of the turned map is `factor` times that of the other, plus `shift`.
void check_potential(const Map& turned, const Map& map, double factor, double shift) {
  const auto a = above_level(turned);
  const auto b = above_level(map);
  for (std::size_t i = 0; i < a.size(); ++i) {
    CHECK(a[i] == Catch::Approx(factor * b[i] + shift).margin(1e-9));
  }
}

}  // namespace

TEST_CASE("knobs left alone change nothing") {
  const auto map = some_map();
  CHECK(with_knobs(test::shared_device(), map, {}).dynamics.factors.size() ==
        map.dynamics.factors.size());
  check_potential(with_knobs(test::shared_device(), map, {}), map, 1, 0);
  MapKnobs still;
  still.drift = 0;
  const auto same = with_knobs(test::shared_device(), map, still);
  CHECK(same.dynamics.log_scale == map.dynamics.log_scale);
  CHECK(same.frame.shape_to_map.translation == map.frame.shape_to_map.translation);
}

TEST_CASE("phase and order keep the potential and change the orbits") {
  const auto map = some_map();
  MapKnobs phase;
  phase.phase = Quaternion{0.6, 0, 1.6, 0};
  MapKnobs order;
  order.order_seed = 9;
  for (const auto& knobs : {phase, order}) {
    const auto changed = with_knobs(test::shared_device(), map, knobs);
    check_potential(changed, map, 1, 0);
    CHECK(norm(changed.dynamics.phase) == Catch::Approx(1));
    const std::vector<Quaternion> start{{0.4, 0.3, -0.2, 0}};
    CHECK(reference::field(changed, start, 2, 1e6) != reference::field(map, start, 2, 1e6));
  }
  CHECK(with_knobs(test::shared_device(), map, order).dynamics.factors[3].center ==
        with_knobs(test::shared_device(), map, order).dynamics.factors[3].center);
}

TEST_CASE("scale shifts the potential and detail stretches it about the level") {
  const auto map = some_map();
  MapKnobs scale;
  scale.scale = 1.25;
  check_potential(with_knobs(test::shared_device(), map, scale), map, 1, -std::log(1.25));
  MapKnobs detail;
  detail.detail = 0.01;
  check_potential(with_knobs(test::shared_device(), map, detail), map, 2, 0);
}

TEST_CASE("steepness stretches the potential about the level, outside alone") {
  Map map = some_map();
  map.dynamics.surface_level = 0.1;
  MapKnobs knobs;
  knobs.steepness = 3;
  const Map steep = with_knobs(test::shared_device(), map, knobs);
  CHECK(steep.layers.steepness == 3);
  const auto plain = above_level(map);
  const auto found = above_level(steep);
  for (std::size_t i = 0; i < plain.size(); ++i) {
    CHECK(found[i] == Catch::Approx(plain[i] > 0 ? 3 * plain[i] : plain[i]).margin(1e-12));
  }
  CHECK(std::ranges::count_if(plain, [](double f) { return f > 0; }) > 5);
  CHECK(std::ranges::count_if(plain, [](double f) { return f < 0; }) > 2);
}

TEST_CASE("moving the origin keeps the shape and calibrates anew") {
  const auto map = calibrated(test::shared_device(), some_map());
  MapKnobs drift;
  drift.drift = 0.5;
  MapKnobs translate;
  translate.translate = Eigen::Vector3d(0, 0, 0.5 * 0.4);
  const auto drifted = with_knobs(test::shared_device(), map, drift);
  const auto translated = with_knobs(test::shared_device(), map, translate);
  check_potential(drifted, map, 1, 0);
  CHECK(drifted.frame.shape_to_map.translation.z() == Catch::Approx(0.3 + 0.5 * 0.4 * 1.5));
  CHECK(translated.dynamics.log_scale == Catch::Approx(drifted.dynamics.log_scale));
  CHECK(drifted.dynamics.log_scale != map.dynamics.log_scale);
  const Field field(test::shared_device(), drifted);
  CHECK(std::log(effective_radius(field, drifted.dynamics.surface_level, 3 * std::sqrt(3.0))) ==
        Catch::Approx(drifted.dynamics.surface_level).margin(1e-3));
}

TEST_CASE("a rotation turns the potential, and about the real axis the orbits too") {
  Map map = some_map();
  map.frame.shape_to_map = {1, {0, 0, 0}};
  const Eigen::Vector3d axis(1, 2, -0.5);
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(std::numbers::pi * 40 / 180, axis.normalized()).toRotationMatrix();
  MapKnobs knobs;
  knobs.rotate = Rotation{axis, 40};
  const auto rotated = with_knobs(test::shared_device(), map, knobs);
  knobs.rotate = Rotation{Eigen::Vector3d::UnitX(), 40};
  const auto rolled = with_knobs(test::shared_device(), map, knobs);
  const Eigen::Matrix3d roll =
      Eigen::AngleAxisd(std::numbers::pi * 40 / 180, Eigen::Vector3d::UnitX()).toRotationMatrix();
  const auto at = [](const Map& some, const Eigen::Vector3d& p, int n) {
    return reference::field(some, std::vector<Quaternion>{{p.x(), p.y(), p.z(), 0}}, n, 1e6)[0];
  };
  const Eigen::Vector3d p(0.4, 0.3, -0.2);
  CHECK(at(rotated, turn * p, 1) == Catch::Approx(at(map, p, 1)));
  CHECK(at(rotated, p, 1) != Catch::Approx(at(map, p, 1)));
  CHECK(at(rotated, turn * p, 2) != Catch::Approx(at(map, p, 2)));
  // Conjugation by a quaternion of the real and k axes turns y and z alone; log, exp and products
  // go along with it.
  for (const int n : {1, 2, 3}) {
    CAPTURE(n);
    Map flat = map, flat_rolled = rolled;
    for (auto* some : {&flat, &flat_rolled}) {
      for (Factor& factor : some->dynamics.factors) factor.center.w = 0;
    }
    CHECK(at(flat_rolled, roll * p, n) == Catch::Approx(at(flat, p, n)));
  }
  CHECK(rotated.frame.box->size().minCoeff() > map.frame.box->size().minCoeff());
}

TEST_CASE("a turned map has a larger box, and a shape and a shell as large as before") {
  const Map map = some_map();
  MapKnobs knobs;
  knobs.rotate = Rotation{{1, 1, 1}, 60};
  const Map turned = with_knobs(test::shared_device(), map, knobs);
  CHECK(turned.frame.box->size().maxCoeff() > 3);
  CHECK(longest_side(turned) == Catch::Approx(longest_side(map)));
  CHECK(with_longest_side(turned, 80).frame.shape_to_map.scale == Catch::Approx(kMapSide / 80));
  CHECK(turned.frame.detail == map.frame.detail);
  CHECK(*turned.frame.own_diagonal() == Catch::Approx(map.frame.box->diagonal()));
  CHECK(turned.frame.box->diagonal() > 1.1 * map.frame.box->diagonal());
  const Map smaller = with_longest_side(turned, longest_side(map) / 2);
  CHECK(*smaller.frame.own_diagonal() == Catch::Approx(map.frame.box->diagonal() / 2));

  // The detail means the same before and after the turn, and after another one.
  MapKnobs thinner;
  thinner.detail = 0.01;
  const Map first = with_knobs(test::shared_device(), turned, thinner);
  thinner.rotate = knobs.rotate;
  const Map last = with_knobs(test::shared_device(), map, thinner);
  const Map twice = with_knobs(test::shared_device(), turned, thinner);
  CHECK(twice.frame.own_diagonal() == turned.frame.own_diagonal());
  for (std::size_t k = 0; k < map.dynamics.factors.size(); ++k) {
    const double exponent = last.dynamics.factors[k].exponent;
    CHECK(first.dynamics.factors[k].exponent == Catch::Approx(exponent));
    CHECK(twice.dynamics.factors[k].exponent == Catch::Approx(exponent));
  }
}

TEST_CASE("the slice is the W that points are seen on") {
  MapKnobs slice;
  slice.slice = 0.25;
  CHECK(with_knobs(test::shared_device(), some_map(), slice).dynamics.slice == 0.25);
}

TEST_CASE("knobs that make no sense are refused by name") {
  const auto refused = [](auto change, const std::string& option) {
    MapKnobs knobs;
    change(knobs);
    CHECK_THROWS_WITH(with_knobs(test::shared_device(), test::random_map(4, 0.1, 0.6, 1), knobs),
                      Catch::Matchers::ContainsSubstring(option));
  };
  const double nan = std::nan("");
  refused([&](MapKnobs& k) { k.detail = nan; }, "detail");
  refused([](MapKnobs& k) { k.detail = 0.01; }, "detail");  // the map does not say its own
  refused([](MapKnobs& k) { k.phase = Quaternion{}; }, "phase");
  refused([&](MapKnobs& k) { k.slice = nan; }, "slice");
  refused([](MapKnobs& k) { k.drift = 0.5; }, "drift");  // nor the inradius
  refused([](MapKnobs& k) { k.scale = 0; }, "scale");
  refused([](MapKnobs& k) { k.steepness = 0.9; }, "steepness");
  refused([&](MapKnobs& k) { k.steepness = nan; }, "steepness");
  refused([](MapKnobs& k) { k.steepness = 101; }, "steepness");
  refused([&](MapKnobs& k) { k.translate = Eigen::Vector3d(0, nan, 0); }, "translate");
}

namespace {

/// Turned a little from how the map has it.
void turn(const Knob& knob, const Map& map, MapKnobs& knobs) {
  const MapKnobs own = knobs_of(map);
  if (knob.name == "detail") {
    knobs.detail = 0.9 * own.detail.value_or(0.02);
  } else if (knob.name == "order_seed") {
    knobs.order_seed = 3;
  } else if (knob.name == "phase") {
    knobs.phase = Quaternion{0.8, 0.6, 0, 0};
  } else if (knob.name == "slice") {
    knobs.slice = 0.01;
  } else if (knob.name == "rotate") {
    knobs.rotate = Rotation{{1, 0, 0}, 10};
  } else if (knob.name == "drift") {
    knobs.drift = 0.1;
  } else if (knob.name == "translate") {
    knobs.translate = Eigen::Vector3d(0.01, 0, 0);
  } else if (knob.name == "scale") {
    knobs.scale = 1.1;
  } else if (knob.name == "steepness") {
    knobs.steepness = 2;
  } else {
    FAIL("a knob that this test does not know: " << knob.name);
  }
}

Map exact_torus(bool of_noise) {
  ExactMapOptions options;
  options.resolution = 32;
  if (of_noise) options.versor = NoiseVersor{};
  return exact_map(test::shared_device(), shapes::torus(), options);
}

}  // namespace

TEST_CASE("the table says which maps bear which knobs") {
  Map silent = some_map();
  silent.frame.detail.reset();
  silent.frame.inradius.reset();
  Map painted = exact_torus(false);
  painted.layers.paint = Paint{};
  std::size_t borne = 0, refused = 0;
  for (const Map& map : {calibrated(test::shared_device(), exact_torus(false)), exact_torus(true),
                         quadratic_map({-0.2, 0.1, 0, 0}), silent}) {
    for (const Knob& knob : knob_table()) {
      CAPTURE(map.dynamics.kind(), knob.name);
      MapKnobs knobs;
      CHECK_FALSE(knob.is_turned(knobs));
      turn(knob, map, knobs);
      CHECK(knob.is_turned(knobs));
      const std::string why = knob.why_not(map);
      if (why.empty()) {
        ++borne;
        CHECK_NOTHROW(knob_named(knob.name));
        if (map.dynamics.kind() != silent.dynamics.kind())
          CHECK_NOTHROW(with_knobs(test::shared_device(), map, knobs));
      } else {
        ++refused;
        CHECK_THROWS_WITH(with_knobs(test::shared_device(), map, knobs),
                          Catch::Matchers::ContainsSubstring(why));
      }
    }
  }
  CHECK(borne > 20);
  CHECK(refused > 8);
  CHECK_FALSE(knob_named("rotate").why_not(painted).empty());
}

TEST_CASE("the knobs as a map has them leave it as it is") {
  const Map map = some_map();
  MapKnobs knobs = knobs_of(map);
  knobs.drift.reset();  // moving by nothing is no move, which would calibrate
  check_potential(with_knobs(test::shared_device(), map, knobs), map, 1, 0);
}

TEST_CASE("names and controls of settings are their own, and sliders hold the usual values") {
  std::set<std::string> options, controls;
  PictureOptions usual;
  const auto check = [&](const Setting& setting) {
    CAPTURE(setting.name);
    CHECK(options.insert(setting.option()).second);
    CHECK_FALSE(setting.help.empty());
    CHECK(setting.help.back() != '.');
    for (const Control& control : setting.controls) {
      CAPTURE(control.name);
      CHECK(controls.insert(control.name).second);
      if (control.words.empty()) CHECK(control.least < control.most);
      if (control.is_logarithmic) CHECK(control.least > 0);
    }
  };
  for (const Knob& knob : knob_table()) check(knob);
  for (const PictureSetting& setting : picture_settings()) {
    check(setting);
    const ValuePlace place = setting.place(usual);
    const auto* const number = std::get_if<double*>(&place);
    if (number == nullptr || setting.controls.size() != 1) continue;
    CHECK(**number >= setting.controls[0].least);
    CHECK(**number <= setting.controls[0].most);
  }
  CHECK(knob_named("detail").option() == "detail");
  CHECK(picture_setting_named("look_at").option() == "look-at");
  CHECK_THROWS_AS(knob_named("look_at"), InputError);
  CHECK_THROWS_AS(picture_setting_named("detail"), InputError);
  CHECK_THROWS_WITH(knob_named("steepness").expect_in_range(0.5),
                    Catch::Matchers::ContainsSubstring("give 1 to 100"));
  const PictureSetting& material = picture_setting_named("material");
  CHECK(material.words.at(material.index_of("trap")) == to_string(Material::trap));
  CHECK(material.index_of("trap") == static_cast<std::size_t>(Material::trap));
  CHECK_THROWS_WITH(material.index_of("glass"), Catch::Matchers::ContainsSubstring("clay, iter"));
}
