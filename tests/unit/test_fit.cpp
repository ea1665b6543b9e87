// The parts of a fit that need no device: budget, schedule, scaling, minimiser, samples, stages.

#include <catch2/catch.hpp>
#include <cmath>
#include <fstream>
#include <limits>
#include <set>

#include "fit/minimize.hpp"
#include "fit/monopoles.hpp"
#include "fit/placement.hpp"
#include "fit/sample_pool.hpp"
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
  Eigen::VectorXd gauss_newton_diagonal(const RationalMap& map) override {
    return gauss_newton(map).diagonal();
  }
  Eigen::MatrixXd pursuit_products(const RationalMap&, const std::vector<Quaternion>&) override {
    return {};
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

Level level_of(Space space) {
  Level level;
  level.space = space;
  return level;
}

/// 200 samples and 10 steps a stage, and a factor moved before each.
Level small_level() {
  Level level;
  level.samples = 200;
  level.band = 0.1;
  level.band_weight = 0.5;
  level.steps = 10;
  level.relocated = 1;
  return level;
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

TEST_CASE("built-in schedules cover the whole budget and end finer than they begin") {
  for (const char* name : {"tight", "fast", "paper"}) {
    const Schedule schedule = find_schedule(name);
    CHECK(schedule.levels.back().until == 1.0);
    CHECK(schedule.levels.back().samples >= schedule.levels.front().samples);
    for (std::size_t i = 1; i < schedule.levels.size(); ++i) {
      CHECK(schedule.levels[i].until > schedule.levels[i - 1].until);
      CHECK(schedule.levels[i].band <= schedule.levels[i - 1].band);
      CHECK(schedule.levels[i].space >= schedule.levels[i - 1].space);
    }
  }
  CHECK_THROWS_WITH(find_schedule("nonesuch"), Catch::Contains("tight"));
}

TEST_CASE("a schedule's file is read, and what is wrong with it is told by line") {
  const test::TemporaryFolder folder;
  const std::string path = folder / "own.toml";
  const auto read = [&](const std::string& text) {
    std::ofstream(path) << text;
    return find_schedule(path);
  };
  const Schedule own = read(
      "evaluations = 7\n[[level]]\nuntil = 0.5\nunknowns = \"clusters\"\nclusters = 9\n"
      "[[level]]\npoints = \"grid\"\nsamples = 12\nreweight = 0.5\n");
  CHECK(own.evaluations == 7);
  REQUIRE(own.levels.size() == 2);
  CHECK(own.levels[0].space == Space::clusters);
  CHECK(own.levels[0].clusters == 9);
  CHECK(own.levels[1].points == Points::grid);
  CHECK(own.levels[1].loss == Loss::tanh);
  CHECK(own.levels[1].samples == 12);
  CHECK(own.levels[1].until == 1);

  const std::string head = "evaluations = 7\n[[level]]\n";
  const auto refused = [&](const std::string& text, const char* why) {
    CHECK_THROWS_WITH(read(text), Catch::Contains(why) && Catch::Contains("own.toml"));
  };
  refused("[[level]", "not TOML");
  refused("evaluations = 7\n", "at least one [[level]]");
  refused("[[level]]\n", "needs 'evaluations'");
  refused(head + "bend = 1\n", ":3: 'bend' is not known");
  refused(head + "samples = 50\n", ":3: 'samples' must be a number between 100");
  refused(head + "samples = nan\n", ":3: 'samples'");
  refused(head + "steps = 2.5\n", ":3: 'steps' must be whole");
  refused(head + "unknowns = \"some\"\n", "\"scalars\"");
  refused(head + "until = 0.4\n", "until = 1");
  refused(head + "until = 0.4\n[[level]]\nuntil = 0.4\n", "must rise");
  refused(head + "loss = \"tanh\"\nrelocate = 1\n", "needs loss");
  CHECK_THROWS_WITH(find_schedule(folder / "none.toml"), Catch::Contains("cannot read"));
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
  const Preconditioner scaling(h, kDamping);
  Eigen::MatrixXd damped = h;
  damped.diagonal() *= 1 + kDamping;
  // R⁻ᵀ (H + λ diag H) R⁻¹ = I, tried on unit vectors.
  for (Eigen::Index i = 0; i < kOrder; ++i) {
    const Eigen::VectorXd unit = Eigen::VectorXd::Unit(kOrder, i);
    const Eigen::VectorXd back = scaling.gradient(damped * scaling.move(unit));
    CHECK((back - unit).cwiseAbs().maxCoeff() < 1e-3);
  }
}

TEST_CASE("the minimiser finds a badly scaled minimum and moves only what the space holds") {
  const auto start = test::random_map(9, 0.1, 0.5, 1);
  const auto goal = test::random_map(9, 0.1, 0.5, 2);
  Quadratic energy(goal);
  const auto minimized = [&](const Subspace& subspace, Budget budget) {
    const Preconditioner scaling(subspace.restricted_matrix(energy.gauss_newton(start)), 1e-3);
    return minimize(energy, start, subspace, scaling, 50, budget);
  };
  const Subspace all(start, level_of(Space::all), Unknowns::all);
  const auto found = minimized(all, budget_of(100));
  CHECK(found.energy_after < 1e-10 * found.energy_before);
  CHECK_FALSE(found.stopped);

  for (const Subspace& exponents : {Subspace(start, level_of(Space::exponents), Unknowns::all),
                                    Subspace(start, level_of(Space::all), Unknowns::exponents)}) {
    const auto part = minimized(exponents, budget_of(100));
    for (std::size_t k = 0; k < 9; ++k) {
      CHECK(part.map.factors[k].center == start.factors[k].center);
      CHECK(part.map.factors[k].exponent == Approx(goal.factors[k].exponent).epsilon(1e-4));
    }
  }

  // From its diagonal alone, which is the whole of this matrix.
  auto budget = budget_of(100);
  const Preconditioner diagonal(all.restricted_diagonal(energy.gauss_newton_diagonal(start)), 1e-3);
  CHECK(minimize(energy, start, all, diagonal, 50, budget).energy_after <
        1e-10 * found.energy_before);

  const auto ended = minimized(all, budget_of(1));
  CHECK(ended.stopped == StopReason::schedule_done);
  CHECK(ended.energy_after <= ended.energy_before);
}

TEST_CASE("coarse spaces scale exponents and move centres by groups") {
  auto map = test::random_map(40, 0.1, 0.5, 4);
  const auto moved = [&](const Subspace& space, Eigen::Index variable) {
    auto unknowns = to_unknowns(map);
    const Eigen::VectorXd move = space.prolonged(Eigen::VectorXd::Unit(space.size(), variable));
    for (std::size_t i = 0; i < unknowns.size(); ++i) {
      unknowns[i] += 0.1 * move[static_cast<Eigen::Index>(i)];
    }
    return with_unknowns(map, unknowns);
  };
  const Subspace scalars(map, level_of(Space::scalars), Unknowns::all);
  REQUIRE(scalars.size() == 3);
  CHECK(moved(scalars, 0).log_scale == Approx(map.log_scale + 0.1));
  for (const bool roots : {true, false}) {
    const auto scaled = moved(scalars, roots ? 1 : 2);
    for (std::size_t k = 0; k < map.factors.size(); ++k) {
      const double a = map.factors[k].exponent;
      CHECK(scaled.factors[k].exponent == Approx(a * ((a > 0) == roots ? 1.1 : 1.0)));
      CHECK(scaled.factors[k].center == map.factors[k].center);
    }
  }

  Level level = level_of(Space::clusters);
  level.clusters = 10;
  const Subspace clusters(map, level, Unknowns::all);
  CHECK(clusters.size() > 1 + 5 * 8);
  CHECK(clusters.size() <= 1 + 5 * 10);
  CHECK(Subspace(map, level, Unknowns::exponents).size() == 1 + (clusters.size() - 1) / 5);
  // Every factor's X is moved by one variable, as far as its whole cluster's.
  std::size_t movers = 0;
  for (Eigen::Index v = 2; v < clusters.size(); v += 5) {
    const auto shifted = moved(clusters, v);
    for (std::size_t k = 0; k < map.factors.size(); ++k) {
      const double change = shifted.factors[k].center.x - map.factors[k].center.x;
      if (change == 0) continue;
      ++movers;
      CHECK(change == Approx(0.1));
    }
  }
  CHECK(movers == map.factors.size());

  // Gradients and matrices are restricted by the same P.
  const Eigen::VectorXd g = Eigen::VectorXd::LinSpaced(1 + 5 * 40, -1, 2);
  const Eigen::VectorXd y = Eigen::VectorXd::LinSpaced(clusters.size(), 0.5, -1);
  CHECK(clusters.restricted_gradient(g).dot(y) == Approx(g.dot(clusters.prolonged(y))));
  const Eigen::MatrixXd h = g.cwiseAbs2().asDiagonal();
  CHECK(y.dot(clusters.restricted_matrix(h) * y) ==
        Approx(clusters.prolonged(y).dot(h * clusters.prolonged(y))));
  CHECK((clusters.restricted_matrix(h).diagonal() - clusters.restricted_diagonal(g.cwiseAbs2()))
            .cwiseAbs()
            .maxCoeff() < 1e-12);
}

TEST_CASE("a stage's samples have the shares, targets and sides it asks for") {
  const auto pool = sphere_pool(5000);
  Level level = small_level();
  level.samples = 1000;
  Random random(3);
  const auto samples = pool.draw(level, random);
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
  CHECK(pool.draw(level, same).position == samples.position);

  level.loss = Loss::tanh;
  const auto sided = pool.draw(level, random);
  double inside = 0;
  double outside = 0;
  for (std::size_t i = 0; i < sided.size(); ++i) {
    CHECK(sided.side[i] * (sided.position[i].norm() - 1) > 0);
    (sided.side[i] < 0 ? inside : outside) += sided.weight[i];
  }
  CHECK(inside == Approx(0.5));
  CHECK(outside == Approx(0.5));
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

TEST_CASE("monopoles on a sphere make its electrostatic field") {
  const auto pool = sphere_pool(6000);
  const auto map = place_monopoles(pool, 40, 1);
  REQUIRE(map.factors.size() == 40);
  for (const auto& [c, exponent] : map.factors) CHECK(norm(c) == Approx(1).margin(1e-9));
  // Outside, as the charge of a conductor at the centre: r Σ a / |x − c| is the same everywhere.
  double low = 1e300;
  double high = -1e300;
  for (const double r : {1.3, 1.6, 1.9}) {
    for (const Eigen::Vector3d& u : {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 0.6, -0.8)}) {
      double sum = 0;
      for (const auto& [c, exponent] : map.factors) {
        sum += exponent / (r * u - Eigen::Vector3d(c.x, c.y, c.z)).norm();
      }
      low = std::min(low, r * sum);
      high = std::max(high, r * sum);
    }
  }
  CHECK(low > 0);
  CHECK(high < 1.02 * low);
  CHECK_THROWS_WITH(place_monopoles({pool.surface, {}, {}}, 40, 1), Catch::Contains("--placement"));
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
