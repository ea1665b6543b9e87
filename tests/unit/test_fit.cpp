// The parts of a fit that need no device: budget, schedule, scaling, minimiser, samples, stages.

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <set>

#include "fit/minimize.hpp"
#include "fit/placement.hpp"
#include "fit/stages.hpp"
#include "qjulia/error.hpp"
#include "random_maps.hpp"
#include "temporary_folder.hpp"

using namespace qjulia;

namespace {

/// E = ½ (v − goal)ᵀ A (v − goal) over the unknowns, A diagonal and badly scaled.
class Quadratic final : public Evaluator {
 public:
  explicit Quadratic(const RationalMap& goal) : goal_(to_unknowns(goal)) {}

  Evaluation evaluate(const RationalMap& map, bool) override {
    const auto v = to_unknowns(map);
    Evaluation result;
    for (std::size_t i = 0; i < v.size(); ++i) {
      const double d = v[i] - goal_[i];
      result.energy += 0.5 * weight(i) * d * d;
      result.gradient.push_back(weight(i) * d);
    }
    return result;
  }
  std::vector<double> field(const RationalMap&) override { return {}; }
  Eigen::MatrixXd gauss_newton(const RationalMap&) override {
    const auto n = static_cast<Eigen::Index>(goal_.size());
    Eigen::MatrixXd h = Eigen::MatrixXd::Zero(n, n);
    for (Eigen::Index i = 0; i < n; ++i) h(i, i) = weight(static_cast<std::size_t>(i));
    return h;
  }

 private:
  static double weight(std::size_t i) { return std::pow(10.0, static_cast<double>(i % 7)); }
  std::vector<double> goal_;
};

Budget budget_of(int evaluations, FitOptions options = {}) {
  return Budget(options, evaluations, Budget::Clock::now(), 0, {});
}

std::vector<std::size_t> first(std::size_t count) {
  std::vector<std::size_t> indices(count);
  for (std::size_t i = 0; i < count; ++i) indices[i] = i;
  return indices;
}

/// Points about the unit sphere, where distances are known.
SamplePool sphere_pool(std::size_t count) {
  std::mt19937_64 bits(5);
  const auto direction = [&] {
    for (;;) {
      const Eigen::Vector3d x(test::uniform(bits, -1, 1), test::uniform(bits, -1, 1),
                              test::uniform(bits, -1, 1));
      if (x.norm() > 0.1 && x.norm() < 1) return Eigen::Vector3d(x.normalized());
    }
  };
  SamplePool pool;
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3d n = direction();
    pool.surface.push_back({n, n});
    const double offset = test::uniform(bits, -0.25, 0.25);
    pool.near.push_back({(1 + offset) * n, offset});
    const Eigen::Vector3d x(test::uniform(bits, -2, 2), test::uniform(bits, -2, 2),
                            test::uniform(bits, -2, 2));
    pool.around.push_back({x, x.norm() - 1});
  }
  return pool;
}

}  // namespace

TEST_CASE("a budget is spent by evaluations, time or a stop request") {
  auto by_schedule = budget_of(2);
  CHECK_FALSE(by_schedule.spent());
  by_schedule.count_evaluation();
  CHECK(by_schedule.fraction() == 0.5);
  by_schedule.count_evaluation();
  CHECK(by_schedule.spent() == StopReason::schedule_done);

  FitOptions asked;
  asked.max_evaluations = 1;
  auto by_caller = budget_of(100, asked);
  by_caller.count_evaluation();
  CHECK(by_caller.spent() == StopReason::evaluations);

  FitOptions hurried;
  hurried.time_limit = 1e-9;
  CHECK(budget_of(100, hurried).spent() == StopReason::time_limit);

  std::stop_source source;
  const Budget interrupted({}, 100, Budget::Clock::now(), 0, source.get_token());
  CHECK_FALSE(interrupted.spent());
  source.request_stop();
  CHECK(interrupted.spent() == StopReason::interrupted);
}

TEST_CASE("schedules are found by name and cover the whole budget") {
  const Schedule& schedule = find_schedule("regression");
  CHECK(schedule.phases.back().until == 1.0);
  for (std::size_t i = 1; i < schedule.phases.size(); ++i) {
    CHECK(schedule.phases[i].until > schedule.phases[i - 1].until);
    CHECK(schedule.phases[i].band <= schedule.phases[i - 1].band);
  }
  CHECK_THROWS_AS(find_schedule("nonesuch"), InputError);
}

TEST_CASE("fit options that make no sense are refused by name") {
  const auto refused = [](auto change, const std::string& option) {
    FitOptions options;
    change(options);
    CHECK_THROWS_WITH(options.validate(), Catch::Contains(option));
    CHECK_THROWS_AS(options.validate(), InputError);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  refused([](FitOptions& o) { o.factors = 0; }, "--factors");
  refused([](FitOptions& o) { o.factors = 1'000'000; }, "--factors");
  refused([&](FitOptions& o) { o.detail = nan; }, "--detail");
  refused([](FitOptions& o) { o.detail = -1; }, "--detail");
  refused([](FitOptions& o) { o.time_limit = -5; }, "--time-limit");
  refused([&](FitOptions& o) { o.time_limit = nan; }, "--time-limit");
  refused([](FitOptions& o) { o.max_evaluations = -1; }, "--max-evaluations");
  refused([](FitOptions& o) { o.schedule = "nonesuch"; }, "--schedule");
  CHECK_NOTHROW(FitOptions{}.validate());
}

TEST_CASE("the preconditioner turns the Gauss-Newton matrix into the identity") {
  // H = B Bᵀ with columns of very different lengths.
  constexpr Eigen::Index kOrder = 12;
  std::mt19937_64 bits(1);
  Eigen::MatrixXd b(kOrder, kOrder);
  for (Eigen::Index i = 0; i < kOrder; ++i) {
    for (Eigen::Index j = 0; j < kOrder; ++j) {
      b(i, j) = test::uniform(bits, -1, 1) * std::pow(10.0, static_cast<double>(i) / 6);
    }
  }
  const Eigen::MatrixXd h = b * b.transpose();
  constexpr double kDamping = 1e-3;
  const Preconditioner scaling(h, first(kOrder), kDamping);
  Eigen::MatrixXd damped = h;
  damped.diagonal() *= 1 + kDamping;
  // R⁻ᵀ (H + λ diag H) R⁻¹ = I, tried on unit vectors.
  for (Eigen::Index i = 0; i < kOrder; ++i) {
    const Eigen::VectorXd unit = Eigen::VectorXd::Unit(kOrder, i);
    const Eigen::VectorXd back = scaling.gradient(damped * scaling.move(unit));
    CHECK((back - unit).cwiseAbs().maxCoeff() < 1e-3);
  }
}

TEST_CASE("the minimiser finds a badly scaled minimum and moves only what is active") {
  const auto start = test::random_map(9, 0.1, 0.5, 1);
  const auto goal = test::random_map(9, 0.1, 0.5, 2);
  Quadratic energy(goal);
  const auto all = first(1 + 5 * 9);
  auto budget = budget_of(100);
  const auto found = minimize(energy, start, all,
                              Preconditioner(energy.gauss_newton(start), all, 1e-3), 50, budget);
  CHECK(found.energy_after < 1e-10 * found.energy_before);
  CHECK_FALSE(found.stopped);

  const auto exponents = first(1 + 9);
  auto second = budget_of(100);
  const auto part =
      minimize(energy, start, exponents,
               Preconditioner(energy.gauss_newton(start), exponents, 1e-3), 50, second);
  for (std::size_t k = 0; k < 9; ++k) {
    CHECK(part.map.factors[k].center == start.factors[k].center);
    CHECK(part.map.factors[k].exponent == Approx(goal.factors[k].exponent).epsilon(1e-4));
  }

  auto short_budget = budget_of(1);
  const auto ended = minimize(
      energy, start, all, Preconditioner(energy.gauss_newton(start), all, 1e-3), 50, short_budget);
  CHECK(ended.stopped == StopReason::schedule_done);
  CHECK(short_budget.evaluations() == 1);
  CHECK(ended.energy_after <= ended.energy_before);
}

TEST_CASE("a stage's samples have the shares, targets and sides it asks for") {
  const auto pool = sphere_pool(5000);
  const Phase phase{"test", 1, 1000, 0.1, 0.5, 1, 0};
  Random random(3);
  const auto samples = pool.draw(phase, random);
  REQUIRE(samples.size() == 1000);
  std::size_t surface = 0;
  std::size_t band = 0;
  std::size_t beyond = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double d = samples.position[i].norm() - 1;
    if (samples.side[i] != 0) {
      ++beyond;
      CHECK(std::abs(d) >= 0.1 - 1e-12);
      CHECK(samples.target[i] == samples.side[i] * 0.1);
      CHECK(samples.side[i] * d > 0);
      CHECK(samples.weight[i] == Approx(0.001));
    } else if (std::abs(d) < 1e-12) {
      ++surface;
      CHECK(samples.target[i] == 0);
    } else {
      ++band;
      CHECK(samples.target[i] == Approx(d).margin(1e-12));
      CHECK(samples.weight[i] == Approx(0.0005));
    }
  }
  CHECK(surface == 500);
  CHECK(band == 350);
  CHECK(beyond == 150);
  Random same(3);
  CHECK(pool.draw(phase, same).position == samples.position);
}

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

 private:
  std::unique_ptr<Evaluator> evaluator_;
  int& left_;
};

}  // namespace

TEST_CASE("a fit that died and was resumed ends as one that did not") {
  const auto pool = sphere_pool(4000);
  FitOptions options;
  options.factors = 8;
  const Schedule schedule{"test", 40, 1e-3, {{"only", 1, 200, 0.1, 0.5, 10, 1}}};
  const test::TemporaryFolder folder;
  const std::filesystem::path path = folder / "fit.checkpoint";
  int left = -1;  // evaluations with gradients until death; negative: none
  const EvaluatorFactory mortal = [&](const Samples& samples, const EnergyOptions& energy) {
    return std::make_unique<MortalEvaluator>(make_reference_evaluator(samples, energy), left);
  };
  const auto start = place_factors(mortal, pool, options.factors, 1);
  const auto unknowns_of_a_run = [&](Checkpoint& checkpoint, bool resume) {
    auto budget = budget_of(schedule.evaluations);
    Stages stages(start, pool, mortal, [](const RationalMap&) { return 0.5; }, options, schedule,
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
  FitOptions options;
  options.factors = 8;
  const Schedule schedule{"test", 40, 1e-3, {{"only", 1, 200, 0.1, 0.5, 10, 1}}};
  auto budget = budget_of(schedule.evaluations);
  int reports = 0;
  const Watch watch{[&](const Progress&) { ++reports; }, {}};
  const auto start = place_factors(reference, pool, options.factors, 1);
  Checkpoint unkept({}, "");
  Stages stages(
      start, pool, reference, [](const RationalMap&) { return 0.5; }, options, schedule, budget,
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
