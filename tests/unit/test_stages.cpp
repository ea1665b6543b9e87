// Stages of a fit, with the reference evaluator alone: what they reach, and how they go on.

#include <algorithm>
#include <catch2/catch.hpp>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <thread>
#include <utility>

#include "fit/placement.hpp"
#include "fit/stages.hpp"
#include "forwarding_evaluator.hpp"
#include "qjulia/detail.hpp"
#include "sphere_pool.hpp"
#include "temporary_folder.hpp"

using namespace qjulia;
using test::budget_of;
using test::small_level;
using test::sphere_pool;

namespace {

/// What a dying process is to a fit.
struct Killed {};

class MortalEvaluator final : public test::ForwardingEvaluator {
 public:
  MortalEvaluator(std::unique_ptr<fitting::Evaluator> evaluator, int& left)
      : ForwardingEvaluator(std::move(evaluator)), left_(left) {}
  fitting::Evaluation evaluate(const RationalMap& map, bool with_gradient) override {
    if (with_gradient && left_-- == 0) throw Killed();
    return ForwardingEvaluator::evaluate(map, with_gradient);
  }

 private:
  int& left_;
};

/// Samples by `draw`; no overlap is measured, and maps stay as they are.
fitting::Stages::Target unscaled(
    std::function<fitting::Samples(const fitting::Level&, base::Random&)> draw) {
  return {std::move(draw), [](const RationalMap&, int) { return 0.5; },
          [](const RationalMap& map, double) { return map; }};
}

/// Signed distances from the unit sphere.
std::vector<double> from_unit_sphere(const std::vector<Eigen::Vector3d>& points) {
  std::vector<double> distances;
  for (const auto& x : points) distances.push_back(x.norm() - 1);
  return distances;
}

/// The same where the wanted detail is a shell of half the thickness, with samples at centres.
fitting::Stages::Target steepening(
    std::function<fitting::Samples(const fitting::Level&, base::Random&)> draw) {
  fitting::Stages::Target target = unscaled(std::move(draw));
  target.distances = from_unit_sphere;
  target.with_detail = [](const RationalMap& map, double) {
    if (map.detail) return map;
    RationalMap scaled = steepened(map, 2);
    scaled.detail = 0.1;
    return scaled;
  };
  return target;
}

fitting::Level polishing_level() {
  fitting::Level level = small_level();
  level.relocated = 0;
  level.iterations = 2;
  level.loss = fitting::Loss::tanh;
  level.alpha = 1;
  return level;
}

}  // namespace

TEST_CASE("a fit that died and was resumed ends as one that did not") {
  const auto pool = sphere_pool(4000);
  const auto draw = [&](const fitting::Level& level, base::Random& random) {
    return pool.draw(level, random);
  };
  FitOptions options;
  options.factors = 8;
  fitting::Schedule schedule{40, 1e-3, {small_level()}};
  // The second stage, in which it dies, may be the second iterate's, or follow one whose
  // Gauss-Newton matrix it does not add to its own.
  enum class Second { like_first, iterated, unlike_first };
  const Second second = GENERATE(Second::like_first, Second::iterated, Second::unlike_first);
  if (second != Second::like_first) {
    schedule.levels.front().until = 0.2;
    schedule.levels.push_back(second == Second::iterated ? polishing_level() : small_level());
    if (second == Second::unlike_first) schedule.levels.front().reweight = 1;
  }
  const test::TemporaryFolder folder;
  const std::filesystem::path path = folder / "fit.checkpoint";
  int left = -1;  // evaluations with gradients until death; negative: none
  const fitting::EvaluatorFactory mortal = [&](const fitting::Samples& samples,
                                               const fitting::EnergyOptions& energy) {
    return std::make_unique<MortalEvaluator>(fitting::make_reference_evaluator(samples, energy),
                                             left);
  };
  const auto start = fitting::place_factors(mortal, pool, options.factors, 1);
  const auto unknowns_of_a_run = [&](fitting::Checkpoint& checkpoint, bool resume) {
    auto budget = budget_of(schedule.evaluations);
    fitting::Stages stages(start, steepening(draw), mortal, options, schedule, budget, checkpoint,
                           {});
    if (resume) stages.resume(test::kept_in(checkpoint).value());
    stages.run();
    CHECK(budget.evaluations() == 40);
    CHECK(stages.reports().back().iterations == schedule.levels.back().iterations);
    return fitting::to_unknowns(stages.map());
  };
  fitting::Checkpoint none({}, "");
  const auto unbroken = unknowns_of_a_run(none, false);

  // In the middle of the second stage, with and without evaluations of it kept.
  for (const double interval : {1e9, 0.0}) {
    fitting::Checkpoint checkpoint(path, "key", interval);
    left = 22;
    CHECK_THROWS_AS(unknowns_of_a_run(checkpoint, false), Killed);
    const fitting::FitState kept = test::kept_in(checkpoint).value();
    CHECK(kept.reports.size() == 1);
    CHECK(kept.evaluated.empty() == (interval > 0));
    left = -1;
    CHECK(unknowns_of_a_run(checkpoint, true) == unbroken);
  }
  CHECK_THROWS_WITH(test::kept_in(fitting::Checkpoint(path, "another")),
                    Catch::Contains("belongs to"));
  const auto check_damaged = [&](std::string bytes) {
    std::ofstream(path, std::ios::binary) << bytes;
    CHECK_THROWS_WITH(test::kept_in(fitting::Checkpoint(path, "key")),
                      Catch::Contains("is damaged"));
  };
  const std::string whole = test::read_text(path);
  for (const std::size_t at : {std::size_t{3}, whole.size() / 3, whole.size() - 1}) {
    std::string spoilt = whole;
    spoilt[at] = static_cast<char>(spoilt[at] ^ 4);
    check_damaged(spoilt);
  }
  check_damaged(whole.substr(0, whole.size() / 2));
  check_damaged("x");
  CHECK_FALSE(test::kept_in(fitting::Checkpoint(folder / "none", "key")).has_value());
}

TEST_CASE("an interrupted fit keeps every evaluation it made, and its plan") {
  const auto pool = sphere_pool(4000);
  const auto draw = [&](const fitting::Level& level, base::Random& random) {
    return pool.draw(level, random);
  };
  const test::TemporaryFolder folder;
  FitOptions options;
  options.factors = 8;
  const fitting::Schedule schedule{40, 1e-3, {small_level()}};
  const auto start =
      fitting::place_factors(fitting::make_reference_evaluator, pool, options.factors, 1);
  for (const int until : {0, 5, 22}) {
    std::stop_source stop;
    if (until == 0) stop.request_stop();
    int made = 0;
    options.observer.on_evaluation = [&](double) {
      if (++made == until) stop.request_stop();
    };
    fitting::Checkpoint checkpoint(folder / "fit.checkpoint", "key", 1e9);
    auto budget = budget_of(schedule.evaluations, {}, stop.get_token());
    fitting::Stages stages(start, unscaled(draw), fitting::make_reference_evaluator, options,
                           schedule, budget, checkpoint, {});
    CHECK(stages.run() == StopReason::interrupted);
    const fitting::FitState kept = test::kept_in(checkpoint).value();
    CHECK(kept.planned == 40);
    CHECK(kept.evaluations + static_cast<int>(kept.evaluated.size()) == until);
  }
}

TEST_CASE("stages fit a sphere with the reference evaluator alone") {
  const auto pool = sphere_pool(4000);
  const auto draw = [&](const fitting::Level& level, base::Random& random) {
    return pool.draw(level, random);
  };
  FitOptions options;
  options.factors = 8;
  const fitting::Schedule schedule{40, 1e-3, {small_level()}};
  auto budget = budget_of(schedule.evaluations);
  int reports = 0;
  const ProgressMonitor monitor{[&](const Progress&) { ++reports; }, {}};
  const auto start =
      fitting::place_factors(fitting::make_reference_evaluator, pool, options.factors, 1);
  fitting::Checkpoint unkept({}, "");
  fitting::Stages stages(start, unscaled(draw), fitting::make_reference_evaluator, options,
                         schedule, budget, unkept, monitor);
  CHECK(stages.run() == StopReason::schedule_done);
  CHECK(budget.evaluations() == 40);
  REQUIRE(stages.reports().size() >= 3);
  CHECK(reports == static_cast<int>(stages.reports().size()));
  CHECK(stages.reports().back().energy_after < 1e-3);
  // F_1 of the fit is the distance to the sphere, at points the fit never saw.
  fitting::Samples unseen;
  for (const double radius : {0.9, 1.0, 1.1}) unseen.add({0, 0.6 * radius, 0.8 * radius}, 1, 0, 0);
  const auto field = fitting::make_reference_evaluator(unseen, {})->field(stages.map());
  CHECK(field[0] == Approx(-0.1).margin(0.03));
  CHECK(field[1] == Approx(0).margin(0.03));
  CHECK(field[2] == Approx(0.1).margin(0.03));
}

TEST_CASE("a stage asks at the centres of poles inside the shape, where they are when it begins") {
  const auto pool = sphere_pool(4000);
  std::vector<fitting::Samples> asked;
  const fitting::EvaluatorFactory keeping = [&](const fitting::Samples& samples,
                                                const fitting::EnergyOptions& options) {
    asked.push_back(samples);
    return fitting::make_reference_evaluator(samples, options);
  };
  const auto draw = [&](const fitting::Level& level, base::Random& random) {
    return pool.draw(level, random);
  };
  FitOptions options;
  options.factors = 8;
  fitting::Level level = small_level();
  level.relocated = 0;
  const fitting::Schedule schedule{10, 1e-3, {level}};
  RationalMap start = fitting::place_factors(keeping, pool, options.factors, 1);
  start.factors.push_back({{0.1, 0.2, 0, 0.01}, -0.3});
  asked.clear();
  fitting::Stages::Target target = unscaled(draw);
  target.distances = from_unit_sphere;
  auto budget = budget_of(schedule.evaluations);
  fitting::Checkpoint unkept({}, "");
  fitting::Stages stages(start, target, keeping, options, schedule, budget, unkept, {});
  stages.run();
  REQUIRE(asked.size() > 2);  // as drawn; with samples at the centre; those alone in the end
  CHECK(asked[0].size() == 200);
  REQUIRE(asked[1].size() == 207);
  CHECK(asked[1].position[200] == Eigen::Vector3d(0.1, 0.2, 0));
  CHECK(asked[1].side.back() == -1);
  CHECK(std::ranges::none_of(asked[2].side, [](double side) { return side == 0; }));
}

TEST_CASE("a body that a root outside makes is gone when a fit ends") {
  const auto pool = sphere_pool(4000);
  const auto draw = [&](const fitting::Level& level, base::Random& random) {
    return pool.draw(level, random);
  };
  FitOptions options;
  options.factors = 8;
  const fitting::Schedule schedule{1, 1e-3, {small_level()}};  // no time to step
  RationalMap start =
      fitting::place_factors(fitting::make_reference_evaluator, pool, options.factors, 1);
  const Quaternion outside{0, 0, 1.8, 1e-3};
  start.factors.push_back({outside, 0.2});
  const auto field_outside = [&](const fitting::Stages::Target& target) {
    auto budget = budget_of(schedule.evaluations);
    fitting::Checkpoint unkept({}, "");
    fitting::Stages stages(start, target, fitting::make_reference_evaluator, options, schedule,
                           budget, unkept, {});
    stages.run();
    fitting::Samples at;
    at.add({outside.x, outside.y, outside.z}, 1, 0, 0);
    return fitting::make_reference_evaluator(at, {})->field(stages.map()).front();
  };
  fitting::Stages::Target target = unscaled(draw);
  CHECK(field_outside(target) < 0);
  target.distances = from_unit_sphere;
  CHECK(field_outside(target) > small_level().band);
  target.overlap = [&](const RationalMap& map, int) {
    return map.factors.back().center == outside ? 0.5 : 0.4;
  };
  CHECK(field_outside(target) < 0);  // not at the shape's cost
}

TEST_CASE(
    "stages of the second iterate begin with a map of the wanted detail, and lower its energy") {
  const auto pool = sphere_pool(4000);
  const auto draw = [&](const fitting::Level& level, base::Random& random) {
    return pool.draw(level, random);
  };
  std::vector<std::pair<fitting::EnergyOptions, fitting::Samples>> asked;
  const fitting::EvaluatorFactory keeping = [&](const fitting::Samples& samples,
                                                const fitting::EnergyOptions& energy) {
    asked.emplace_back(energy, samples);
    return fitting::make_reference_evaluator(samples, energy);
  };
  FitOptions options;
  options.factors = 8;
  fitting::Level first = small_level();
  first.until = 0.5;
  const fitting::Schedule schedule{60, 1e-3, {first, polishing_level()}};
  auto target = steepening(draw);
  int scaled = 0;
  target.with_detail = [&scaled, steepen = target.with_detail](RationalMap map, double iou) {
    if (map.detail) return map;
    ++scaled;
    map = steepen(map, iou);
    map.surface_level = 0.25;
    map.log_scale += 0.25;
    return map;
  };
  auto budget = budget_of(schedule.evaluations);
  fitting::Checkpoint unkept({}, "");
  const auto start = fitting::place_factors(keeping, pool, options.factors, 1);
  asked.clear();
  fitting::Stages stages(start, target, keeping, options, schedule, budget, unkept, {});
  CHECK(stages.run() == StopReason::schedule_done);
  CHECK(stages.map().detail == 0.1);
  CHECK(scaled == 1);
  CHECK(asked.front().first.iterations == 1);
  CHECK(asked.back().first.iterations == 2);
  CHECK(asked.back().first.loss == fitting::Loss::tanh);
  CHECK(std::ranges::count(asked.back().second.target, 0.25) == 200);
  CHECK(stages.reports().back().iterations == 2);
  const auto polishing = std::ranges::find(stages.reports(), 2, &StageReport::iterations);
  CHECK(polishing->energy_after < polishing->energy_before);
}

TEST_CASE("a fit ends after the stage that reaches the target IoU, of the last iterate asked for") {
  const auto pool = sphere_pool(4000);
  const auto draw = [&](const fitting::Level& level, base::Random& random) {
    return pool.draw(level, random);
  };
  FitOptions options;
  options.factors = 8;
  options.target_iou = 0.79;
  const bool is_polished = GENERATE(false, true);
  fitting::Schedule schedule{1000, 1e-3, {small_level()}};
  if (is_polished) {
    schedule.levels.front().until = 0.02;
    schedule.levels.push_back(polishing_level());
  }
  auto target = steepening(draw);
  double reached = 0.5;
  target.overlap = [&](const RationalMap&, int iterations) {
    return iterations > 1 ? 0.8 : is_polished ? 0.95 : reached += 0.1;
  };
  auto budget = budget_of(schedule.evaluations);
  fitting::Checkpoint unkept({}, "");
  fitting::Stages stages(
      fitting::place_factors(fitting::make_reference_evaluator, pool, options.factors, 1), target,
      fitting::make_reference_evaluator, options, schedule, budget, unkept, {});
  CHECK(stages.run() == StopReason::target_iou);
  CHECK(stages.reports().back().iterations == (is_polished ? 2 : 1));
  if (!is_polished) CHECK(stages.reports().size() == 3);
}

TEST_CASE("no stage is begun that the time limit would end before its first step") {
  const auto pool = sphere_pool(1000);
  const auto draw = [&](const fitting::Level& level, base::Random& random) {
    return pool.draw(level, random);
  };
  constexpr std::chrono::milliseconds kPreparation(300);
  const fitting::EvaluatorFactory slow = [&](const fitting::Samples& samples,
                                             const fitting::EnergyOptions& energy) {
    std::this_thread::sleep_for(kPreparation);
    return fitting::make_reference_evaluator(samples, energy);
  };
  FitOptions options;
  options.factors = 8;
  options.time_limit = 0.8;
  fitting::Level level = small_level();
  level.relocated = 0;
  level.steps = 1;
  const fitting::Schedule schedule{10'000, 1e-3, {level}};
  const auto start = fitting::place_factors(
      [](const fitting::Samples& samples, const fitting::EnergyOptions& energy) {
        return fitting::make_reference_evaluator(samples, energy);
      },
      pool, options.factors, 1);
  auto budget = budget_of(schedule.evaluations, options);
  fitting::Checkpoint unkept({}, "");
  fitting::Stages stages(start, unscaled(draw), slow, options, schedule, budget, unkept, {});
  CHECK(stages.run() == StopReason::time_limit);
  CHECK(!stages.reports().empty());
  CHECK(budget.time_left() > 0);
}

TEST_CASE("a level on a grid ends when it has converged, and so does the fit at the last") {
  const auto pool = sphere_pool(4000);
  FitOptions options;
  options.factors = 8;
  fitting::Level coarse = small_level();
  coarse.relocated = 0;
  coarse.points = fitting::Points::grid;
  coarse.name = "coarse";
  coarse.until = 0.9;
  fitting::Level fine = coarse;
  fine.name = "fine";
  fine.until = 1;
  const fitting::Schedule schedule{10'000, 1e-3, {coarse, fine}};
  const auto draw = [&](const fitting::Level& level, base::Random&) {
    base::Random same(level.name == "fine" ? 2 : 1);
    return pool.draw(level, same);
  };
  auto budget = budget_of(schedule.evaluations);
  fitting::Checkpoint unkept({}, "");
  fitting::Stages stages(
      fitting::place_factors(fitting::make_reference_evaluator, pool, options.factors, 1),
      unscaled(draw), fitting::make_reference_evaluator, options, schedule, budget, unkept, {});
  CHECK(stages.run() == StopReason::converged);
  CHECK(budget.fraction() < 0.5);
  CHECK(stages.reports().front().name == "coarse");
  CHECK(stages.reports().back().name == "fine");
}

TEST_CASE("reweighting moves weight to what is badly captured and keeps its sums") {
  const auto pool = sphere_pool(4000);
  FitOptions options;
  options.factors = 8;
  const fitting::Loss loss = GENERATE(fitting::Loss::distance, fitting::Loss::tanh);
  fitting::Level level = small_level();
  level.loss = loss;
  level.relocated = 0;
  level.reweight = 2;
  std::vector<fitting::Samples> given;
  const fitting::EvaluatorFactory keeping = [&](const fitting::Samples& samples,
                                                const fitting::EnergyOptions& energy) {
    given.push_back(samples);
    return fitting::make_reference_evaluator(samples, energy);
  };
  const auto start = fitting::place_factors(keeping, pool, options.factors, 1);
  given.clear();
  const fitting::Schedule schedule{5, 1e-3, {level}};
  auto budget = budget_of(schedule.evaluations);
  fitting::Checkpoint unkept({}, "");
  const auto draw = [&](const fitting::Level& l, base::Random& random) {
    return pool.draw(l, random);
  };
  fitting::Stages stages(start, unscaled(draw), keeping, options, schedule, budget, unkept, {});
  stages.run();
  REQUIRE(given.size() == 2);
  const auto field = fitting::make_reference_evaluator(given[0], {})->field(start);
  double before[2] = {0, 0};
  double after[2] = {0, 0};
  double least[2] = {1e300, 1e300};
  double most[2] = {0, 0};
  std::size_t worst[2] = {0, 0};
  for (std::size_t i = 0; i < given[0].size(); ++i) {
    const std::size_t side = loss == fitting::Loss::tanh && given[0].side[i] < 0 ? 1 : 0;
    before[side] += given[0].weight[i];
    after[side] += given[1].weight[i];
    const double ratio = given[1].weight[i] / given[0].weight[i];
    least[side] = std::min(least[side], ratio);
    if (ratio > most[side]) worst[side] = i;
    most[side] = std::max(most[side], ratio);
  }
  for (const std::size_t side : {std::size_t{0}, std::size_t{1}}) {
    if (before[side] == 0) continue;
    CHECK(after[side] == Approx(before[side]));
    CHECK(least[side] >= 1.0 / 3 - 1e-12);
    CHECK(most[side] > 1);
  }
  // The heaviest sample is the worst captured one.
  if (loss == fitting::Loss::distance) {
    double largest = 0;
    for (std::size_t i = 0; i < field.size(); ++i) {
      const double residual = field[i] - given[0].target[i];
      if (given[0].side[i] * residual <= 0) largest = std::max(largest, std::abs(residual));
    }
    CHECK(std::abs(field[worst[0]] - given[0].target[worst[0]]) == Approx(largest));
  }
}
