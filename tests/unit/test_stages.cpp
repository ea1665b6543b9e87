// Stages of a fit, with the reference evaluator alone: what they reach, and how they go on.

#include <algorithm>
#include <catch2/catch_all.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <utility>

#include "device/opencl.hpp"
#include "fit/placement.hpp"
#include "fit/stages.hpp"
#include "forwarding_evaluator.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/map/detail.hpp"
#include "random_maps.hpp"
#include "sphere_pool.hpp"
#include "temporary_folder.hpp"
#include "toy_problem.hpp"

using namespace qjulia;
using test::budget_of;
using test::from_unit_sphere;
using test::plan_of;
using test::small_level;
using test::sphere_pool;
using test::ToyProblem;

namespace {

/// What a dying process is to a fit.
struct Killed {};

class MortalEvaluator final : public test::ForwardingEvaluator {
 public:
  MortalEvaluator(std::unique_ptr<energy::Evaluator> evaluator, int& left)
      : ForwardingEvaluator(std::move(evaluator)), left_(left) {}
  energy::Evaluation evaluate(const Map& map, bool with_gradient) override {
    if (with_gradient && left_-- == 0) throw Killed();
    return ForwardingEvaluator::evaluate(map, with_gradient);
  }

 private:
  int& left_;
};

/// Has no memory for the second of all matrices by blocks; counts them, and diagonals.
class Forgetful final : public test::ForwardingEvaluator {
 public:
  Forgetful(std::unique_ptr<energy::Evaluator> evaluator, int& matrices, int& diagonals)
      : ForwardingEvaluator(std::move(evaluator)), matrices_(matrices), diagonals_(diagonals) {}
  energy::BlockCurvature gauss_newton_blocks(const Map& map,
                                             const energy::NeighbourBlocks& blocks) override {
    if (++matrices_ == 2) {
      throw DeviceError("toy", "clCreateBuffer", CL_MEM_OBJECT_ALLOCATION_FAILURE);
    }
    return ForwardingEvaluator::gauss_newton_blocks(map, blocks);
  }
  Eigen::VectorXd gauss_newton_diagonal(const Map& map) override {
    ++diagonals_;
    return ForwardingEvaluator::gauss_newton_diagonal(map);
  }

 private:
  int& matrices_;
  int& diagonals_;
};

/// A unit sphere where the wanted detail is a shell of half the thickness.
ToyProblem steepening(ToyProblem::Draw draw) {
  ToyProblem problem(std::move(draw));
  problem.on_distances = from_unit_sphere;
  problem.on_finished = [](const Map& map) {
    if (map.frame.detail) return map;
    Map scaled = steepened(map, 2);
    scaled.frame.detail = 0.1;
    return scaled;
  };
  return problem;
}

fitting::Level polishing_level() {
  fitting::Level level = small_level();
  level.relocated = 0;
  level.iterations = 2;
  level.loss = energy::Loss::tanh;
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
  const energy::EvaluatorFactory mortal = [&](const energy::Samples& samples,
                                              const energy::EnergySettings& energy) {
    return std::make_unique<MortalEvaluator>(energy::make_reference_evaluator(samples, energy),
                                             left);
  };
  const auto start = fitting::place_factors(mortal, pool, *options.factors, 1);
  ToyProblem problem = steepening(draw);
  problem.make_evaluator = mortal;
  const auto unknowns_of_a_run = [&](const fitting::Checkpoint& checkpoint, bool resume) {
    fitting::FitPlan plan = plan_of(options, schedule);
    plan.checkpoint = checkpoint;
    fitting::Stages stages(problem, start, std::move(plan));
    if (resume) stages.resume(test::kept_in(checkpoint).value());
    stages.run();
    CHECK(stages.budget().evaluations() == 40);
    CHECK(stages.reports().back().iterations == schedule.levels.back().iterations);
    return energy::to_unknowns(stages.finished().map);
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
    CHECK(std::isinf(kept.most_triangles));
    left = -1;
    CHECK(unknowns_of_a_run(checkpoint, true) == unbroken);
  }
  CHECK_THROWS_WITH(test::kept_in(fitting::Checkpoint(path, "another")),
                    Catch::Matchers::ContainsSubstring("belongs to"));
  const auto check_damaged = [&](std::string bytes) {
    std::ofstream(path, std::ios::binary) << bytes;
    CHECK_THROWS_WITH(test::kept_in(fitting::Checkpoint(path, "key")),
                      Catch::Matchers::ContainsSubstring("is damaged"));
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

TEST_CASE("a checkpoint keeps the sum of matrices, entry by entry") {
  const test::TemporaryFolder folder;
  const Map map = test::random_map(5, 0.1, 0.6, 1);
  std::mt19937_64 bits(2);
  fitting::FitState state;
  state.map = map;
  state.curvature.weight = Eigen::VectorXd::LinSpaced(5, 1, 2);
  state.curvature.sum.blocks = {{0, 3}, {1, 2, 4}};
  for (const auto& block : state.curvature.sum.blocks) {
    const auto order = static_cast<Eigen::Index>(5 * block.size());
    Eigen::MatrixXd half(order, order);
    for (double& entry : half.reshaped()) entry = test::uniform(bits, -1, 1);
    state.curvature.sum.own.emplace_back(half + half.transpose());
  }
  fitting::Checkpoint checkpoint(folder / "fit.checkpoint", "key");
  checkpoint.save(state);
  const fitting::CurvatureSum kept = test::kept_in(checkpoint).value().curvature;
  CHECK(kept.weight == state.curvature.weight);
  CHECK(kept.sum.blocks == state.curvature.sum.blocks);
  CHECK(kept.sum.own == state.curvature.sum.own);

  const auto check_refused = [&](const auto& damage) {
    fitting::FitState damaged = state;
    damage(damaged.curvature);
    checkpoint.save(damaged);
    CHECK_THROWS_WITH(test::kept_in(checkpoint), Catch::Matchers::ContainsSubstring("is damaged"));
  };
  check_refused([](fitting::CurvatureSum& c) { c.weight = Eigen::VectorXd::Ones(4); });
  check_refused([](fitting::CurvatureSum& c) { c.sum.blocks.front().back() = 5; });
  check_refused([](fitting::CurvatureSum& c) { c.sum.blocks.front() = {3, 0}; });
  check_refused([](fitting::CurvatureSum& c) { c.sum.own.front().conservativeResize(9, 9); });
}

TEST_CASE("a stage without memory for blocks goes on with the diagonal, and the sum begins anew") {
  const auto pool = sphere_pool(4000);
  FitOptions options;
  options.factors = 8;
  int matrices = 0, diagonals = 0;
  ToyProblem problem(
      [&](const fitting::Level& level, base::Random& random) { return pool.draw(level, random); });
  const auto start = fitting::place_factors(energy::make_reference_evaluator, pool, 8, 1);
  problem.make_evaluator = [&](const energy::Samples& samples,
                               const energy::EnergySettings& settings) {
    return std::make_unique<Forgetful>(energy::make_reference_evaluator(samples, settings),
                                       matrices, diagonals);
  };
  fitting::Stages stages(problem, start, plan_of(options, {40, 1e-3, {small_level()}}));
  while (!stages.step()) {
  }
  CHECK(stages.reports().size() == static_cast<std::size_t>(matrices));
  CHECK(matrices > 2);
  CHECK(diagonals == 1);  // of the second stage
  const auto& reports = stages.reports();
  CHECK(reports.back().energy_after < reports.front().energy_before);
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
      fitting::place_factors(energy::make_reference_evaluator, pool, *options.factors, 1);
  for (const int until : {0, 5, 22}) {
    std::stop_source stop;
    if (until == 0) stop.request_stop();
    int made = 0;
    options.observer.on_evaluation = [&](double) {
      if (++made == until) stop.request_stop();
    };
    fitting::Checkpoint checkpoint(folder / "fit.checkpoint", "key", 1e9);
    const ToyProblem problem(draw);
    fitting::FitPlan plan = plan_of(options, schedule, stop.get_token());
    plan.checkpoint = checkpoint;
    plan.most_triangles = 12'345;
    fitting::Stages stages(problem, start, std::move(plan));
    CHECK(stages.run() == StopReason::interrupted);
    const fitting::FitState kept = test::kept_in(checkpoint).value();
    CHECK(kept.planned == 40);
    CHECK(kept.most_triangles == 12'345);
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
  fitting::FitPlan plan = plan_of(options, schedule);
  int reports = 0;
  plan.monitor.on_progress = [&](const Progress&) { ++reports; };
  const auto start =
      fitting::place_factors(energy::make_reference_evaluator, pool, *options.factors, 1);
  const ToyProblem problem(draw);
  fitting::Stages stages(problem, start, std::move(plan));
  CHECK(stages.run() == StopReason::schedule_done);
  CHECK(stages.budget().evaluations() == 40);
  REQUIRE(stages.reports().size() >= 3);
  CHECK(reports == static_cast<int>(stages.reports().size()));
  CHECK(stages.reports().back().energy_after < 1e-3);
  // F_1 of the fit is the distance to the sphere, at points the fit never saw.
  energy::Samples unseen;
  for (const double radius : {0.9, 1.0, 1.1}) unseen.add({0, 0.6 * radius, 0.8 * radius}, 1, 0, 0);
  const auto field = energy::make_reference_evaluator(unseen, {})->field(stages.finished().map);
  CHECK(field[0] == Catch::Approx(-0.1).margin(0.03));
  CHECK(field[1] == Catch::Approx(0).margin(0.03));
  CHECK(field[2] == Catch::Approx(0.1).margin(0.03));
}

TEST_CASE("a fit can be taken step by step: each is a stage, and none follows the last") {
  const auto pool = sphere_pool(4000);
  const ToyProblem problem(
      [&](const fitting::Level& level, base::Random& random) { return pool.draw(level, random); });
  FitOptions options;
  options.factors = 8;
  const fitting::Schedule schedule{40, 1e-3, {small_level()}};
  const auto start =
      fitting::place_factors(energy::make_reference_evaluator, pool, *options.factors, 1);
  fitting::Stages whole(problem, start, plan_of(options, schedule));
  whole.run();

  fitting::Stages stepped(problem, start, plan_of(options, schedule));
  std::size_t steps = 0;
  std::optional<StopReason> ended;
  while (!ended) {
    ended = stepped.step();
    if (ended) break;
    CHECK(stepped.reports().size() == ++steps);
    CHECK(stepped.finished().map.dynamics.factors.size() == start.dynamics.factors.size());
  }
  CHECK(ended == StopReason::schedule_done);
  CHECK(stepped.step() == ended);
  CHECK(stepped.budget().evaluations() == 40);
  CHECK(stepped.reports().size() == whole.reports().size());
  CHECK(energy::to_unknowns(stepped.finished().map) == energy::to_unknowns(whole.finished().map));
}

TEST_CASE("a stage asks at the centres of poles inside the shape, where they are when it begins") {
  const auto pool = sphere_pool(4000);
  std::vector<energy::Samples> asked;
  const energy::EvaluatorFactory keeping = [&](const energy::Samples& samples,
                                               const energy::EnergySettings& options) {
    asked.push_back(samples);
    return energy::make_reference_evaluator(samples, options);
  };
  const auto draw = [&](const fitting::Level& level, base::Random& random) {
    return pool.draw(level, random);
  };
  FitOptions options;
  options.factors = 8;
  fitting::Level level = small_level();
  level.relocated = 0;
  const fitting::Schedule schedule{10, 1e-3, {level}};
  Map start = fitting::place_factors(keeping, pool, *options.factors, 1);
  start.dynamics.factors.push_back({{0.1, 0.2, 0, 0.01}, -0.3});
  asked.clear();
  ToyProblem problem(draw);
  problem.make_evaluator = keeping;
  problem.on_distances = from_unit_sphere;
  fitting::Stages stages(problem, start, plan_of(options, schedule));
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
  Map start = fitting::place_factors(energy::make_reference_evaluator, pool, *options.factors, 1);
  const Quaternion outside{0, 0, 1.8, 1e-3};
  start.dynamics.factors.push_back({outside, 0.2});
  const auto field_outside = [&](const ToyProblem& problem) {
    fitting::Stages stages(problem, start, plan_of(options, schedule));
    stages.run();
    energy::Samples at;
    at.add({outside.x, outside.y, outside.z}, 1, 0, 0);
    return energy::make_reference_evaluator(at, {})->field(stages.finished().map).front();
  };
  ToyProblem problem(draw);
  CHECK(field_outside(problem) < 0);
  problem.on_distances = from_unit_sphere;
  CHECK(field_outside(problem) > small_level().band);
  problem.on_overlap = [&](const Map& map, int) {
    return map.dynamics.factors.back().center == outside ? 0.5 : 0.4;
  };
  CHECK(field_outside(problem) < 0);  // not at the shape's cost
  problem.on_overlap = [&](const Map& map, int) {
    return map.dynamics.factors.back().center == outside ? 0.5 : 0.4995;
  };
  CHECK(field_outside(problem) > small_level().band);
  options.target_iou = 0.5;
  CHECK(field_outside(problem) < 0);  // nor at that of the IoU that was asked for
}

TEST_CASE("the IoU of a stage is that of the map which the fit would give, and so is the target") {
  const auto pool = sphere_pool(4000);
  ToyProblem problem = steepening(
      [&](const fitting::Level& level, base::Random& random) { return pool.draw(level, random); });
  // As fitted, every map has the wanted IoU.
  double finished = 0.2;
  problem.on_overlap = [&](const Map& map, int) { return map.frame.detail ? finished : 0.9; };
  FitOptions options;
  options.factors = 8;
  options.target_iou = 0.4;
  int stages_seen = 0;
  options.observer.on_stage = [&](const StageReport& report, const Map& map) {
    CHECK(report.iou == finished);
    CHECK(map.frame.detail == 0.1);
    if (++stages_seen == 3) finished = 0.5;
  };
  const fitting::Schedule schedule{1000, 1e-3, {small_level()}};
  fitting::Stages stages(
      problem, fitting::place_factors(energy::make_reference_evaluator, pool, *options.factors, 1),
      plan_of(options, schedule));
  CHECK(stages.run() == StopReason::target_iou);
  CHECK(stages.reports().size() == 4);
}

TEST_CASE(
    "stages of the second iterate begin with a map of the wanted detail, and lower its energy") {
  const auto pool = sphere_pool(4000);
  const auto draw = [&](const fitting::Level& level, base::Random& random) {
    return pool.draw(level, random);
  };
  std::vector<std::pair<energy::EnergySettings, energy::Samples>> asked;
  const energy::EvaluatorFactory keeping = [&](const energy::Samples& samples,
                                               const energy::EnergySettings& energy) {
    asked.emplace_back(energy, samples);
    return energy::make_reference_evaluator(samples, energy);
  };
  FitOptions options;
  options.factors = 8;
  fitting::Level first = small_level();
  first.until = 0.5;
  const fitting::Schedule schedule{60, 1e-3, {first, polishing_level()}};
  ToyProblem problem = steepening(draw);
  int scaled = 0;
  problem.make_evaluator = keeping;
  problem.on_finished = [&scaled, steepen = problem.on_finished](Map map) {
    if (map.frame.detail) return map;
    ++scaled;
    map = steepen(map);
    map.dynamics.surface_level = 0.25;
    map.dynamics.log_scale += 0.25;
    return map;
  };
  const auto start = fitting::place_factors(keeping, pool, *options.factors, 1);
  asked.clear();
  fitting::Stages stages(problem, start, plan_of(options, schedule));
  CHECK(stages.run() == StopReason::schedule_done);
  CHECK(stages.finished().map.frame.detail == 0.1);
  CHECK(scaled == std::ranges::count(stages.reports(), 1, &StageReport::iterations));
  CHECK(asked.front().first.iterations == 1);
  CHECK(asked.back().first.iterations == 2);
  CHECK(asked.back().first.loss == energy::Loss::tanh);
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
  ToyProblem problem = steepening(draw);
  double reached = 0.5;
  problem.on_overlap = [&](const Map&, int iterations) {
    return iterations > 1 ? 0.8 : is_polished ? 0.95 : reached += 0.1;
  };
  fitting::Stages stages(
      problem, fitting::place_factors(energy::make_reference_evaluator, pool, *options.factors, 1),
      plan_of(options, schedule));
  CHECK(stages.run() == StopReason::target_iou);
  CHECK(stages.reports().back().iterations == (is_polished ? 2 : 1));
  if (!is_polished) CHECK(stages.reports().size() == 3);
}

TEST_CASE("no stage is begun that the time limit would end before its first step") {
  const auto pool = sphere_pool(1000);
  const auto draw = [&](const fitting::Level& level, base::Random& random) {
    return pool.draw(level, random);
  };
  // A clock that only preparation moves on, so that the machine's load does not matter.
  constexpr double kPreparation = 0.3;
  double seconds = 0;
  const energy::EvaluatorFactory slow = [&](const energy::Samples& samples,
                                            const energy::EnergySettings& energy) {
    seconds += kPreparation;
    return energy::make_reference_evaluator(samples, energy);
  };
  FitOptions options;
  options.factors = 8;
  options.time_limit = 0.8;
  fitting::Level level = small_level();
  level.relocated = 0;
  level.steps = 1;
  const fitting::Schedule schedule{10'000, 1e-3, {level}};
  const auto start = fitting::place_factors(
      [](const energy::Samples& samples, const energy::EnergySettings& energy) {
        return energy::make_reference_evaluator(samples, energy);
      },
      pool, *options.factors, 1);
  ToyProblem problem(draw);
  problem.make_evaluator = slow;
  fitting::FitPlan plan = plan_of(options, schedule);
  plan.budget = fitting::Budget(options, schedule.evaluations, 0,
                                [&] { return fitting::Moment{.seconds = seconds}; });
  fitting::Stages stages(problem, start, std::move(plan));
  CHECK(stages.run() == StopReason::time_limit);
  CHECK(stages.reports().size() == 2);
  CHECK(seconds == Catch::Approx(2 * kPreparation));
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
  const ToyProblem problem(draw);
  fitting::Stages stages(
      problem, fitting::place_factors(energy::make_reference_evaluator, pool, *options.factors, 1),
      plan_of(options, schedule));
  CHECK(stages.run() == StopReason::converged);
  CHECK(stages.budget().fraction() < 0.5);
  CHECK(stages.reports().front().name == "coarse");
  CHECK(stages.reports().back().name == "fine");
}

TEST_CASE("reweighting moves weight to what is badly captured and keeps its sums") {
  const auto pool = sphere_pool(4000);
  FitOptions options;
  options.factors = 8;
  const energy::Loss loss = GENERATE(energy::Loss::distance, energy::Loss::tanh);
  fitting::Level level = small_level();
  level.loss = loss;
  level.relocated = 0;
  level.reweight = 2;
  std::vector<energy::Samples> given;
  const energy::EvaluatorFactory keeping = [&](const energy::Samples& samples,
                                               const energy::EnergySettings& energy) {
    given.push_back(samples);
    return energy::make_reference_evaluator(samples, energy);
  };
  const auto start = fitting::place_factors(keeping, pool, *options.factors, 1);
  given.clear();
  const fitting::Schedule schedule{5, 1e-3, {level}};
  const auto draw = [&](const fitting::Level& l, base::Random& random) {
    return pool.draw(l, random);
  };
  ToyProblem problem(draw);
  problem.make_evaluator = keeping;
  fitting::Stages stages(problem, start, plan_of(options, schedule));
  stages.run();
  REQUIRE(given.size() == 2);
  const auto field = energy::make_reference_evaluator(given[0], {})->field(start);
  double before[2] = {0, 0};
  double after[2] = {0, 0};
  double least[2] = {1e300, 1e300};
  double most[2] = {0, 0};
  std::size_t worst[2] = {0, 0};
  for (std::size_t i = 0; i < given[0].size(); ++i) {
    const std::size_t side = loss == energy::Loss::tanh && given[0].side[i] < 0 ? 1 : 0;
    before[side] += given[0].weight[i];
    after[side] += given[1].weight[i];
    const double ratio = given[1].weight[i] / given[0].weight[i];
    least[side] = std::min(least[side], ratio);
    if (ratio > most[side]) worst[side] = i;
    most[side] = std::max(most[side], ratio);
  }
  for (const std::size_t side : {std::size_t{0}, std::size_t{1}}) {
    if (before[side] == 0) continue;
    CHECK(after[side] == Catch::Approx(before[side]));
    CHECK(least[side] >= 1.0 / 3 - 1e-12);
    CHECK(most[side] > 1);
  }
  // The heaviest sample is the worst captured one.
  if (loss == energy::Loss::distance) {
    double largest = 0;
    for (std::size_t i = 0; i < field.size(); ++i) {
      const double residual = field[i] - given[0].target[i];
      if (given[0].side[i] * residual <= 0) largest = std::max(largest, std::abs(residual));
    }
    CHECK(std::abs(field[worst[0]] - given[0].target[worst[0]]) == Catch::Approx(largest));
  }
}

TEST_CASE("a fit that is stopped while it draws samples ends with the map that it has") {
  const auto pool = sphere_pool(4000);
  int draws = 0;
  const auto draw = [&](const fitting::Level& level, base::Random& random) {
    if (++draws == 2) throw Interrupted();
    return pool.draw(level, random);
  };
  FitOptions options;
  options.factors = 8;
  const fitting::Schedule schedule{1000, 1e-3, {small_level()}};
  const ToyProblem problem(draw);
  fitting::Stages stages(
      problem, fitting::place_factors(energy::make_reference_evaluator, pool, *options.factors, 1),
      plan_of(options, schedule));
  CHECK(stages.run() == StopReason::interrupted);
  CHECK(stages.reports().size() == 1);
}
