// Stages of a fit, with the reference evaluator alone: what they reach, and how they go on.

#include <algorithm>
#include <catch2/catch.hpp>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <thread>
#include <utility>

#include "fit/placement.hpp"
#include "fit/stages.hpp"
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

class MortalEvaluator : public Evaluator {
 public:
  MortalEvaluator(std::unique_ptr<Evaluator> evaluator, int& left)
      : evaluator_(std::move(evaluator)), left_(left) {}
  Evaluation evaluate(const RationalMap& map, bool with_gradient) override {
    if (with_gradient && left_-- == 0) throw Killed();
    return evaluator_->evaluate(map, with_gradient);
  }
  std::vector<double> field(const RationalMap& map) override { return evaluator_->field(map); }
  Eigen::MatrixXd gauss_newton(const RationalMap& map) override {
    return evaluator_->gauss_newton(map);
  }
  Eigen::VectorXd gauss_newton_diagonal(const RationalMap& map) override {
    return evaluator_->gauss_newton_diagonal(map);
  }
  Eigen::MatrixXd pursuit_products(const RationalMap& map,
                                   const std::vector<Quaternion>& centers) override {
    return evaluator_->pursuit_products(map, centers);
  }

 private:
  std::unique_ptr<Evaluator> evaluator_;
  int& left_;
};

/// Samples by `draw`; no overlap is measured, and maps stay as they are.
Stages::Target unscaled(std::function<Samples(const Level&, Random&)> draw) {
  return {std::move(draw), [](const RationalMap&, int) { return 0.5; },
          [](const RationalMap& map, double) { return map; }};
}

/// The same where the wanted detail is a shell of half the thickness.
Stages::Target steepening(std::function<Samples(const Level&, Random&)> draw) {
  Stages::Target target = unscaled(std::move(draw));
  target.with_detail = [](const RationalMap& map, double) {
    if (map.detail) return map;
    RationalMap scaled = steepened(map, 2);
    scaled.detail = 0.1;
    return scaled;
  };
  return target;
}

Level polishing_level() {
  Level level = small_level();
  level.relocated = 0;
  level.iterations = 2;
  level.loss = Loss::tanh;
  level.alpha = 1;
  return level;
}

}  // namespace

TEST_CASE("a fit that died and was resumed ends as one that did not") {
  const auto pool = sphere_pool(4000);
  const auto draw = [&](const Level& level, Random& random) { return pool.draw(level, random); };
  FitOptions options;
  options.factors = 8;
  Schedule schedule{40, 1e-3, {small_level()}};
  // The second stage, in which it dies, may be the second iterate's.
  if (GENERATE(false, true)) {
    schedule.levels.front().until = 0.2;
    schedule.levels.push_back(polishing_level());
  }
  const test::TemporaryFolder folder;
  const std::filesystem::path path = folder / "fit.checkpoint";
  int left = -1;  // evaluations with gradients until death; negative: none
  const EvaluatorFactory mortal = [&](const Samples& samples, const EnergyOptions& energy) {
    return std::make_unique<MortalEvaluator>(make_reference_evaluator(samples, energy), left);
  };
  const auto start = place_factors(mortal, pool, options.factors, 1);
  const auto unknowns_of_a_run = [&](Checkpoint& checkpoint, bool resume) {
    auto budget = budget_of(schedule.evaluations);
    Stages stages(start, steepening(draw), mortal, options, schedule, budget, checkpoint, {});
    if (resume) stages.resume(checkpoint.load().value());
    stages.run();
    CHECK(budget.evaluations() == 40);
    CHECK(stages.reports().back().iterations == schedule.levels.back().iterations);
    return to_unknowns(stages.map());
  };
  Checkpoint none({}, "");
  const auto unbroken = unknowns_of_a_run(none, false);

  // In the middle of the second stage, with and without evaluations of it kept.
  for (const double interval : {1e9, 0.0}) {
    Checkpoint checkpoint(path, "key", interval);
    left = 17;
    CHECK_THROWS_AS(unknowns_of_a_run(checkpoint, false), Killed);
    const FitState kept = checkpoint.load().value();
    CHECK(kept.reports.size() == 1);
    CHECK(kept.evaluated.empty() == (interval > 0));
    left = -1;
    CHECK(unknowns_of_a_run(checkpoint, true) == unbroken);
  }
  CHECK_THROWS_WITH(Checkpoint(path, "another").load(), Catch::Contains("belongs to"));
  std::filesystem::resize_file(path, std::filesystem::file_size(path) / 2);
  CHECK_THROWS_WITH(Checkpoint(path, "key").load(), Catch::Contains("is damaged"));
  CHECK_FALSE(Checkpoint(folder / "none", "key").load().has_value());
}

TEST_CASE("stages fit a sphere with the reference evaluator alone") {
  const auto pool = sphere_pool(4000);
  const EvaluatorFactory reference = [](const Samples& samples, const EnergyOptions& options) {
    return make_reference_evaluator(samples, options);
  };
  const auto draw = [&](const Level& level, Random& random) { return pool.draw(level, random); };
  FitOptions options;
  options.factors = 8;
  const Schedule schedule{40, 1e-3, {small_level()}};
  auto budget = budget_of(schedule.evaluations);
  int reports = 0;
  const Watch watch{[&](const Progress&) { ++reports; }, {}};
  const auto start = place_factors(reference, pool, options.factors, 1);
  Checkpoint unkept({}, "");
  Stages stages(start, unscaled(draw), reference, options, schedule, budget, unkept, watch);
  CHECK(stages.run() == StopReason::schedule_done);
  CHECK(budget.evaluations() == 40);
  REQUIRE(stages.reports().size() >= 3);
  CHECK(reports == static_cast<int>(stages.reports().size()));
  CHECK(stages.reports().back().energy_after < 1e-3);
  // F_1 of the fit is the distance to the sphere, at points the fit never saw.
  Samples unseen;
  for (const double radius : {0.9, 1.0, 1.1}) unseen.add({0, 0.6 * radius, 0.8 * radius}, 1, 0, 0);
  const auto field = make_reference_evaluator(unseen, {})->field(stages.map());
  CHECK(field[0] == Approx(-0.1).margin(0.03));
  CHECK(field[1] == Approx(0).margin(0.03));
  CHECK(field[2] == Approx(0.1).margin(0.03));
}

TEST_CASE(
    "stages of the second iterate begin with a map of the wanted detail, and lower its energy") {
  const auto pool = sphere_pool(4000);
  const auto draw = [&](const Level& level, Random& random) { return pool.draw(level, random); };
  std::vector<std::pair<EnergyOptions, Samples>> asked;
  const EvaluatorFactory keeping = [&](const Samples& samples, const EnergyOptions& energy) {
    asked.emplace_back(energy, samples);
    return make_reference_evaluator(samples, energy);
  };
  FitOptions options;
  options.factors = 8;
  Level first = small_level();
  first.until = 0.5;
  const Schedule schedule{40, 1e-3, {first, polishing_level()}};
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
  Checkpoint unkept({}, "");
  const auto start = place_factors(keeping, pool, options.factors, 1);
  asked.clear();
  Stages stages(start, target, keeping, options, schedule, budget, unkept, {});
  CHECK(stages.run() == StopReason::schedule_done);
  CHECK(stages.map().detail == 0.1);
  CHECK(scaled == 1);
  CHECK(asked.front().first.iterations == 1);
  CHECK(asked.back().first.iterations == 2);
  CHECK(asked.back().first.loss == Loss::tanh);
  CHECK(std::ranges::count(asked.back().second.target, 0.25) == 200);
  CHECK(stages.reports().back().iterations == 2);
  CHECK(stages.reports().back().energy_after < stages.reports().back().energy_before);
}

TEST_CASE("no stage is begun that the time limit would end before its first step") {
  const auto pool = sphere_pool(1000);
  const auto draw = [&](const Level& level, Random& random) { return pool.draw(level, random); };
  constexpr std::chrono::milliseconds kPreparation(300);
  const EvaluatorFactory slow = [&](const Samples& samples, const EnergyOptions& energy) {
    std::this_thread::sleep_for(kPreparation);
    return make_reference_evaluator(samples, energy);
  };
  FitOptions options;
  options.factors = 8;
  options.time_limit = 0.8;
  Level level = small_level();
  level.relocated = 0;
  level.steps = 1;
  const Schedule schedule{10'000, 1e-3, {level}};
  const auto start = place_factors(
      [](const Samples& samples, const EnergyOptions& energy) {
        return make_reference_evaluator(samples, energy);
      },
      pool, options.factors, 1);
  auto budget = budget_of(schedule.evaluations, options);
  Checkpoint unkept({}, "");
  Stages stages(start, unscaled(draw), slow, options, schedule, budget, unkept, {});
  CHECK(stages.run() == StopReason::time_limit);
  CHECK(!stages.reports().empty());
  CHECK(budget.time_left() > 0);
}

TEST_CASE("a level on a grid ends when it has converged, and so does the fit at the last") {
  const auto pool = sphere_pool(4000);
  FitOptions options;
  options.factors = 8;
  Level coarse = small_level();
  coarse.relocated = 0;
  coarse.points = Points::grid;
  coarse.name = "coarse";
  coarse.until = 0.9;
  Level fine = coarse;
  fine.name = "fine";
  fine.until = 1;
  const Schedule schedule{10'000, 1e-3, {coarse, fine}};
  const auto draw = [&](const Level& level, Random&) {
    Random same(level.name == "fine" ? 2 : 1);
    return pool.draw(level, same);
  };
  const EvaluatorFactory reference = [](const Samples& samples, const EnergyOptions& energy) {
    return make_reference_evaluator(samples, energy);
  };
  auto budget = budget_of(schedule.evaluations);
  Checkpoint unkept({}, "");
  Stages stages(place_factors(reference, pool, options.factors, 1), unscaled(draw), reference,
                options, schedule, budget, unkept, {});
  CHECK(stages.run() == StopReason::converged);
  CHECK(budget.fraction() < 0.5);
  CHECK(stages.reports().front().name == "coarse");
  CHECK(stages.reports().back().name == "fine");
}

TEST_CASE("reweighting moves weight to what is badly captured and keeps its sums") {
  const auto pool = sphere_pool(4000);
  FitOptions options;
  options.factors = 8;
  const Loss loss = GENERATE(Loss::distance, Loss::tanh);
  Level level = small_level();
  level.loss = loss;
  level.relocated = 0;
  level.reweight = 2;
  std::vector<Samples> given;
  const EvaluatorFactory keeping = [&](const Samples& samples, const EnergyOptions& energy) {
    given.push_back(samples);
    return make_reference_evaluator(samples, energy);
  };
  const auto start = place_factors(keeping, pool, options.factors, 1);
  given.clear();
  const Schedule schedule{5, 1e-3, {level}};
  auto budget = budget_of(schedule.evaluations);
  Checkpoint unkept({}, "");
  const auto draw = [&](const Level& l, Random& random) { return pool.draw(l, random); };
  Stages stages(start, unscaled(draw), keeping, options, schedule, budget, unkept, {});
  stages.run();
  REQUIRE(given.size() == 2);
  const auto field = make_reference_evaluator(given[0], {})->field(start);
  double before[2] = {0, 0};
  double after[2] = {0, 0};
  double least[2] = {1e300, 1e300};
  double most[2] = {0, 0};
  std::size_t worst[2] = {0, 0};
  for (std::size_t i = 0; i < given[0].size(); ++i) {
    const std::size_t side = loss == Loss::tanh && given[0].side[i] < 0 ? 1 : 0;
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
  if (loss == Loss::distance) {
    double largest = 0;
    for (std::size_t i = 0; i < field.size(); ++i) {
      const double residual = field[i] - given[0].target[i];
      if (given[0].side[i] * residual <= 0) largest = std::max(largest, std::abs(residual));
    }
    CHECK(std::abs(field[worst[0]] - given[0].target[worst[0]]) == Approx(largest));
  }
}
