// Relocation: factors that matter little go to where the fit is worst.

#include <catch2/catch_all.hpp>

#include "fit/relocate.hpp"
#include "random_maps.hpp"

using namespace qjulia;

namespace {

constexpr std::size_t kMissing = 3;

/// What is to be fitted.
Map wanted() {
  Map map = test::random_map(8, 0.4, 0.8, 21);
  for (Factor& factor : map.dynamics.factors) factor.center.w = 0.15;
  map.dynamics.factors[kMissing] = {{0.6, 0.7, -0.5, 0.15}, 0.9};
  return map;
}

/// Samples whose targets are the wanted map's field.
energy::Samples samples_of(const Map& map) {
  energy::Samples samples = test::random_samples(3000, 22);
  std::ranges::fill(samples.side, 0);
  samples.target = energy::make_reference_evaluator(samples, {})->field(map);
  return samples;
}

double distance_between(const Quaternion& a, const Quaternion& b) { return norm(a - b); }

}  // namespace

TEST_CASE("a factor that does nothing is moved to where one is missing") {
  const Map whole = wanted();
  const energy::Samples samples = samples_of(whole);
  const auto evaluator = energy::make_reference_evaluator(samples, {});
  // Near to the others and weak; or strong, and so far off that it is a constant.
  const Factor idle = GENERATE(Factor{{-0.2, 0.1, 0.3, 0.5}, 1e-3}, Factor{{7, 0, 0, 0}, 0.9});
  Map map = whole;
  map.dynamics.factors[kMissing] = idle;
  base::Random random(1);
  const Map moved = fitting::relocate_factors(*evaluator, samples, map, 1, random);

  REQUIRE(moved.dynamics.factors.size() == map.dynamics.factors.size());
  for (std::size_t k = 0; k < map.dynamics.factors.size(); ++k) {
    if (k != kMissing) CHECK(moved.dynamics.factors[k].center == map.dynamics.factors[k].center);
  }
  const Factor& found = moved.dynamics.factors[kMissing];
  CHECK(distance_between(found.center, whole.dynamics.factors[kMissing].center) < 0.3);
  CHECK(found.exponent == Catch::Approx(0.9).margin(0.3));
  CHECK(evaluator->evaluate(moved, false).energy < 0.1 * evaluator->evaluate(map, false).energy);

  base::Random same(1);
  const Map again = fitting::relocate_factors(*evaluator, samples, map, 1, same);
  CHECK(energy::to_unknowns(again) == energy::to_unknowns(moved));
}

TEST_CASE("samples that ask for nothing draw no factor") {
  const Map whole = wanted();
  energy::Samples samples = samples_of(whole);
  Map map = whole;
  map.dynamics.factors[kMissing] = {{-0.2, 0.1, 0.3, 0.5}, 1e-3};
  // About the missing factor F is too high: there "at least so far out" asks for nothing.
  const auto missed = [&](std::size_t i) {
    const Quaternion& c = whole.dynamics.factors[kMissing].center;
    return (samples.position[i] - Eigen::Vector3d(c.x, c.y, c.z)).norm() < 0.8;
  };
  for (std::size_t i = 0; i < samples.size(); ++i) samples.side[i] = missed(i) ? 1 : 0;
  const auto evaluator = energy::make_reference_evaluator(samples, {});
  base::Random random(1);
  const Map moved = fitting::relocate_factors(*evaluator, samples, map, 1, random);
  CHECK(distance_between(moved.dynamics.factors[kMissing].center,
                         whole.dynamics.factors[kMissing].center) > 0.5);
}

TEST_CASE("several new factors keep apart") {
  const Map whole = wanted();
  const energy::Samples samples = samples_of(whole);
  const auto evaluator = energy::make_reference_evaluator(samples, {});
  Map map = whole;
  for (const std::size_t k : {std::size_t{1}, kMissing, std::size_t{6}}) {
    map.dynamics.factors[k] = {{7, 1.0 * static_cast<double>(k), 0, 0}, 0.1};
  }
  base::Random random(2);
  const Map moved = fitting::relocate_factors(*evaluator, samples, map, 3, random);
  for (const auto& [a, b] :
       {std::pair<std::size_t, std::size_t>{1, kMissing}, {1, 6}, {kMissing, 6}}) {
    const Quaternion d = moved.dynamics.factors[a].center - moved.dynamics.factors[b].center;
    CHECK(std::hypot(d.x, d.y, d.z) > std::min(std::abs(moved.dynamics.factors[a].center.w),
                                               std::abs(moved.dynamics.factors[b].center.w)));
  }
  CHECK(evaluator->evaluate(moved, false).energy < 0.3 * evaluator->evaluate(map, false).energy);
}
