// Stages of a fit, with the reference evaluator alone: what they reach, and how they go on.

#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>

#include "fit/placement.hpp"
#include "fit/stages.hpp"
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

}  // namespace

TEST_CASE("a fit that died and was resumed ends as one that did not") {
  const auto pool = sphere_pool(4000);
  const auto draw = [&](const Level& level, Random& random) { return pool.draw(level, random); };
  FitOptions options;
  options.factors = 8;
  const Schedule schedule{40, 1e-3, {small_level()}};
  const test::TemporaryFolder folder;
  const std::filesystem::path path = folder / "fit.checkpoint";
  int left = -1;  // evaluations with gradients until death; negative: none
  const EvaluatorFactory mortal = [&](const Samples& samples, const EnergyOptions& energy) {
    return std::make_unique<MortalEvaluator>(make_reference_evaluator(samples, energy), left);
  };
  const auto start = place_factors(mortal, pool, options.factors, 1);
  const auto unknowns_of_a_run = [&](Checkpoint& checkpoint, bool resume) {
    auto budget = budget_of(schedule.evaluations);
    Stages stages(start, draw, mortal, [](const RationalMap&) { return 0.5; }, options, schedule,
                  budget, checkpoint, {});
    if (resume) stages.resume(checkpoint.load().value());
    stages.run();
    CHECK(budget.evaluations() == 40);
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
  Stages stages(
      start, draw, reference, [](const RationalMap&) { return 0.5; }, options, schedule, budget,
      unkept, watch);
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
  Stages stages(place_factors(reference, pool, options.factors, 1), draw, reference,
                [](const RationalMap&) { return 0.5; }, options, schedule, budget, unkept, {});
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
  Stages stages(
      start, [&](const Level& l, Random& random) { return pool.draw(l, random); }, keeping,
      [](const RationalMap&) { return 0.5; }, options, schedule, budget, unkept, {});
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
