// Maps, times and boxes of morphs that nobody should give.

#include "hostile.hpp"
#include "qjulia/morph/morph_steps.hpp"
#include "qjulia/morph/versor_transfer.hpp"
#include "shaped_map.hpp"

using namespace qjulia;
using namespace qjulia::test;

namespace {

const Device& way_device() { return test::shared_device(); }

}  // namespace

TEST_CASE("hostile ends and times of a morph are refused") {
  const Map map = shaped_map();
  const auto refuses = [&](const Map& other) {
    CHECK_THROWS_AS(Morph(way_device(), map, other), InputError);
    CHECK_THROWS_AS(Morph(way_device(), other, map), InputError);
  };
  refuses(Map());
  refuses(quadratic_map({0, 0.5, 0, 0}));
  for (const auto& change : std::vector<std::function<void(Map&)>>{
           [](Map& m) { m.dynamics.factors[1].exponent = kNan; },
           [](Map& m) { m.frame.detail.reset(); }, [](Map& m) { m.frame.box.reset(); },
           [](Map& m) { m.frame.inradius.reset(); },
           [](Map& m) {
             m.layers.portals.emplace_back();
             m.layers.portals[0].center = {0.8, 0, 0};
             m.layers.portals[0].radius = 0.1;
           }}) {
    Map other = map;
    change(other);
    refuses(other);
  }
  const Morph morph(way_device(), map, map);
  CHECK(morph.pairs().matched == map.dynamics.factors.size());
  for (const double t : {kNan, kInfinity, -0.1, 1.1}) CHECK_THROWS_AS(morph.at(t), OptionError);
}

TEST_CASE("hostile steps of a morph are refused") {
  CHECK(morph_settings().size() == 2);
  const Map map = shaped_map();
  const Morph morph(way_device(), map, map);
  std::vector<int> taken;
  const auto take = [&](const Map&, int step) { taken.push_back(step); };
  for (const MorphOptions& options :
       {MorphOptions{.steps = 1}, MorphOptions{.steps = 10'000},
        MorphOptions{.steps = 2, .flicker_cells = 7}, MorphOptions{.steps = 2, .flicker_cells = -1},
        MorphOptions{.steps = 2, .flicker_cells = 257}}) {
    CHECK_THROWS_AS(options.validate(), OptionError);
    CHECK_THROWS_AS(make_steps(way_device(), morph, options, take), OptionError);
  }
  CHECK(taken.empty());
  const MorphOptions few{.steps = 2, .flicker_cells = 8};
  CHECK(make_steps(way_device(), morph, few, take).steps == 0);
  CHECK(taken == std::vector<int>{1, 2});
}

TEST_CASE("hostile maps and cells of a versor's transfer are refused") {
  const Map map = shaped_map();
  const auto refuses = [&](const Map& other) {
    CHECK_THROWS_AS(with_versor_of(way_device(), map, other), InputError);
    CHECK_THROWS_AS(with_versor_of(way_device(), other, map), InputError);
  };
  refuses(Map());
  refuses(quadratic_map({0, 0.5, 0, 0}));
  Map without = map;
  without.frame.inradius.reset();
  refuses(without);
  for (const int cells : {-1, 0, 31, 385}) {
    CHECK_THROWS_AS(with_versor_of(way_device(), map, map, cells), OptionError);
  }
}

TEST_CASE("hostile boxes and cells of flicker are refused") {
  for (const double x : {kNan, kInfinity, 1.0, 2.0}) {
    CHECK_THROWS_AS(FlickerMeter(way_device(), Box{{x, x, x}, {1, 1, 1}}), OptionError);
  }
  const Box box{{-1, -1, -1}, {1, 1, 1}};
  for (const int cells : {-1, 0, 7, 257}) {
    CHECK_THROWS_AS(FlickerMeter(way_device(), box, cells), OptionError);
  }
  for (const int n : {0, 17}) {
    CHECK_THROWS_AS(FlickerMeter(way_device(), box, 8, n), OptionError);
  }
  FlickerMeter meter(way_device(), box, 8);
  CHECK_THROWS_AS(meter.add(Map()), InputError);
  CHECK(meter.flicker().steps == 0);
}
