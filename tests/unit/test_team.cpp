// One fit over ranks that are threads.

#include <catch2/catch_all.hpp>
#include <limits>
#include <thread>

#include "base/random.hpp"
#include "device/opencl.hpp"
#include "fit/placement.hpp"
#include "fit/stages.hpp"
#include "fit/team.hpp"
#include "forwarding_evaluator.hpp"
#include "qjulia/base/error.hpp"
#include "rank_threads.hpp"
#include "sphere_pool.hpp"
#include "toy_problem.hpp"

using namespace qjulia;
using fitting::Team;

namespace {

/// Runs `work` on ranks 0 … size − 1. @return their results, or what they threw, by rank.
template <class Work>
auto on_ranks(int size, const Work& work) {
  using Result = std::invoke_result_t<Work, Team&>;
  struct Outcome {
    Result result;
    std::string error;
  };
  test::RankTable table(size);
  std::vector<Outcome> outcomes(static_cast<std::size_t>(size));
  {
    std::vector<std::jthread> threads;
    for (int r = 0; r < size; ++r) {
      threads.emplace_back([&table, &outcomes, &work, r] {
        test::RankThread ranks(table, r);
        Team team(ranks);
        Outcome& mine = outcomes[static_cast<std::size_t>(r)];
        try {
          mine.result = team.run([&] { return work(team); });
        } catch (const std::exception& error) {
          mine.error = error.what();
        }
      });
    }
  }
  return outcomes;
}

const energy::EvaluatorFactory kReference = [](const energy::Samples& samples,
                                               const energy::EnergySettings& options) {
  return energy::make_reference_evaluator(samples, options);
};

energy::Samples some_samples(std::size_t count) {
  base::Random random(5);
  energy::Samples samples;
  for (std::size_t i = 0; i < count; ++i) {
    samples.add({random.uniform(-2, 2), random.uniform(-2, 2), random.uniform(-2, 2)},
                random.uniform(0.1, 1), random.uniform(-1, 1), i % 3 == 0 ? 1 : 0);
  }
  return samples;
}

Map some_map() {
  Map map;
  map.dynamics.slice = 0.1;
  map.dynamics.log_scale = 0.3;
  map.dynamics.factors = {
      {{0.1, 0.2, -0.3, 0.1}, 2}, {{-1, 0.5, 0.2, 0}, 1.5}, {{1.5, -1.8, 1, 0.2}, -0.7}};
  return map;
}

/// Fails where matrices are computed, and at the samples.
class Failing final : public test::ForwardingEvaluator {
 public:
  using Fail = std::function<void()>;
  Failing(std::unique_ptr<energy::Evaluator> evaluator, Fail fail)
      : ForwardingEvaluator(std::move(evaluator)), fail_(std::move(fail)) {}
  std::vector<double> field(const Map& map) override {
    fail_();
    return ForwardingEvaluator::field(map);
  }
  Eigen::MatrixXd gauss_newton(const Map& map) override {
    fail_();
    return ForwardingEvaluator::gauss_newton(map);
  }
  energy::BlockCurvature gauss_newton_blocks(const Map& map,
                                             const energy::NeighbourBlocks& blocks) override {
    fail_();
    return ForwardingEvaluator::gauss_newton_blocks(map, blocks);
  }

 private:
  Fail fail_;
};

void lack_memory() { throw DeviceError("toy", "clCreateBuffer", CL_MEM_OBJECT_ALLOCATION_FAILURE); }

/// The reference, which on one rank fails.
energy::EvaluatorFactory failing_on(int rank, const Team& team, Failing::Fail fail) {
  return [=, &team](const energy::Samples& samples,
                    const energy::EnergySettings& options) -> std::unique_ptr<energy::Evaluator> {
    auto evaluator = energy::make_reference_evaluator(samples, options);
    if (team.rank() != rank) return evaluator;
    return std::make_unique<Failing>(std::move(evaluator), fail);
  };
}

/// Whether `work` ends for want of device memory.
template <class Work>
bool lacks_memory(const Work& work) {
  try {
    work();
  } catch (const DeviceError& error) {
    return error.code() == CL_MEM_OBJECT_ALLOCATION_FAILURE;
  }
  return false;
}

}  // namespace

TEST_CASE("energy and gradient are the same bits on any number of ranks, and on each") {
  const energy::Samples samples = some_samples(53);
  const Map map = some_map();
  const auto whole = energy::make_reference_evaluator(samples, {})->evaluate(map, true);
  const auto found = [&](int size) {
    return on_ranks(size, [&](Team& team) {
      return fitting::distributed(team, kReference, 5)(samples, {})->evaluate(map, true);
    });
  };
  const energy::Evaluation first = found(1).front().result;
  CHECK(first.energy == Catch::Approx(whole.energy).epsilon(1e-12));
  for (std::size_t i = 0; i < whole.gradient.size(); ++i) {
    CHECK(first.gradient[i] == Catch::Approx(whole.gradient[i]).epsilon(1e-9).margin(1e-12));
  }
  for (const int size : {2, 3, 5, 7}) {
    for (const auto& [e, error] : found(size)) {
      CHECK(error.empty());
      CHECK(e.energy == first.energy);
      CHECK(e.gradient == first.gradient);
    }
  }
}

TEST_CASE("fields come in the samples' order, matrices are those of all samples") {
  const energy::Samples samples = some_samples(20);
  const Map map = some_map();
  const std::vector<Quaternion> centers = {{0.3, 0, 0, 0.1}, {-0.5, 0.4, 0, 0}};
  const energy::EnergySettings options{energy::Loss::tanh, 1, 3.0, 7.0};
  struct Answers {
    std::vector<double> field;
    double energy = 0;
    Eigen::MatrixXd matrix, products;
    Eigen::VectorXd diagonal;
  };
  const auto answers = [&](energy::Evaluator& evaluator) {
    return Answers{evaluator.field(map), evaluator.evaluate(map, false).energy,
                   evaluator.gauss_newton(map), evaluator.pursuit_products(map, centers),
                   evaluator.gauss_newton_diagonal(map)};
  };
  const Answers whole = answers(*energy::make_reference_evaluator(samples, options));
  for (const auto& [found, error] : on_ranks(2, [&](Team& team) {
         return answers(*fitting::distributed(team, kReference, 3)(samples, options));
       })) {
    CHECK(error.empty());
    CHECK(found.field == whole.field);
    CHECK(found.energy == Catch::Approx(whole.energy).epsilon(1e-12));
    CHECK(found.matrix.isApprox(whole.matrix, 1e-9));
    CHECK(found.products.isApprox(whole.products, 1e-9));
    CHECK(found.diagonal.isApprox(whole.diagonal, 1e-9));
  }
}

TEST_CASE("blocks of matrices are the same bits on each of any number of ranks") {
  const energy::Samples samples = some_samples(30);
  const Map map = some_map();
  const energy::NeighbourBlocks blocks = energy::neighbour_blocks(map, 2);
  REQUIRE(blocks.size() > 1);
  const auto whole =
      energy::make_reference_evaluator(samples, {})->gauss_newton_blocks(map, blocks);
  for (const int size : {1, 2, 3}) {
    for (const auto& [found, error] : on_ranks(size, [&](Team& team) {
           return fitting::distributed(team, kReference, 3)(samples, {})
               ->gauss_newton_blocks(map, blocks);
         })) {
      CHECK(error.empty());
      CHECK(found.blocks == blocks);
      CHECK(found.own == whole.own);
      CHECK(found.coarse == whole.coarse);
    }
  }
}

TEST_CASE("a matrix of many samples is the undivided one of one part, and near it of several") {
  const energy::Samples samples = some_samples(210'001);
  const Map map = some_map();
  const auto whole = energy::make_reference_evaluator(samples, {})->gauss_newton(map);
  for (const int parts : {1, 2}) {
    for (const auto& [found, error] : on_ranks(2, [&](Team& team) {
           return fitting::distributed(team, kReference, parts)(samples, {})->gauss_newton(map);
         })) {
      CHECK(error.empty());
      // By the logarithm of the scale, H is the sum of weights; a few samples near centres make up
      // much of the rest.
      CHECK(found(0, 0) == Catch::Approx(whole(0, 0)).epsilon(0.02));
      CHECK(found.isApprox(whole, 0.3));
      CHECK((found == whole) == (parts == 1));
    }
  }
}

TEST_CASE("more parts than samples") {
  for (const auto& [field, error] : on_ranks(2, [&](Team& team) {
         return fitting::distributed(team, kReference, 64)(some_samples(3), {})->field(some_map());
       })) {
    CHECK(error.empty());
    CHECK(field.size() == 3);
  }
}

TEST_CASE("what one rank throws ends all, wherever they are") {
  const auto failing = [](Team& team, const auto& others) {
    if (team.rank() == 1) throw Error("the device is gone");
    return others();
  };
  const auto check = [](const auto& outcomes) {
    REQUIRE(outcomes.size() == 3);
    CHECK(outcomes[0].error == "rank 1: the device is gone");
    CHECK(outcomes[1].error == "the device is gone");
    CHECK(outcomes[2].error == "rank 1: the device is gone");
  };
  check(on_ranks(3, [&](Team& team) {  // the others wait for it in an evaluation
    return failing(team, [&] {
      const auto make = fitting::distributed(team, kReference, 3);
      for (;;) make(some_samples(9), {})->evaluate(some_map(), true);
      return 0;
    });
  }));
  check(on_ranks(3, [&](Team& team) {  // the others have done their part
    return failing(team, [] { return 0; });
  }));
  const energy::EvaluatorFactory small = [](const energy::Samples& samples,
                                            const energy::EnergySettings& options) {
    // The second part is a sample longer than the first; rank 0 takes matrices of all three.
    if (samples.size() == 2) throw Error("the device is gone");
    return energy::make_reference_evaluator(samples, options);
  };
  const auto two = on_ranks(2, [&](Team& team) {
    return fitting::distributed(team, small, 2)(some_samples(3), {})->field(some_map());
  });
  CHECK(two[0].error == "rank 1: the device is gone");
  // All of them at once: each says what it knows.
  for (const auto& outcome : on_ranks(2, [](Team&) -> int { throw InputError("no interior"); })) {
    CHECK(outcome.error == "no interior");
  }
}

TEST_CASE("where one rank lacks memory, all throw the device's error and can go on") {
  const Map map = some_map();
  const energy::Samples samples = some_samples(8);
  const auto check = [&](const auto& lacking) {
    for (const auto& [energy, error] : on_ranks(2, [&](Team& team) {
           if (!lacking(team)) return -1.0;
           return fitting::distributed(team, kReference, 2)(samples, {})
               ->evaluate(map, false)
               .energy;
         })) {
      CHECK(error.empty());
      CHECK(energy > 0);
    }
  };
  check([&](Team& team) {  // for its own part
    const auto made = fitting::distributed(team, failing_on(1, team, lack_memory), 2)(samples, {});
    return lacks_memory([&] { made->field(map); });
  });
  check([&](Team& team) {  // for matrices
    const auto made = fitting::distributed(team, failing_on(0, team, lack_memory), 2)(samples, {});
    return lacks_memory([&] { made->gauss_newton(map); }) &&
           lacks_memory([&] { made->gauss_newton_blocks(map, energy::neighbour_blocks(map, 2)); });
  });
  check([&](Team& team) {  // for the samples
    const energy::EvaluatorFactory none = [&](const auto& part, const auto& options) {
      if (team.rank() == 1) lack_memory();
      return energy::make_reference_evaluator(part, options);
    };
    return lacks_memory([&] { fitting::distributed(team, none, 2)(samples, {}); });
  });
}

TEST_CASE("what rank 0 throws at a matrix ends all") {
  for (const auto& outcome : on_ranks(2, [](Team& team) {
         const auto gone = [] { throw Error("the device is gone"); };
         return fitting::distributed(team, failing_on(0, team, gone), 2)(some_samples(8), {})
             ->gauss_newton(some_map());
       })) {
    CHECK_THAT(outcome.error, Catch::Matchers::EndsWith("the device is gone"));
  }
}

TEST_CASE("bytes are sent as 0 to 255 on every machine, and nothing else is taken for one") {
  std::string bytes;
  for (int n = 0; n < 256; ++n) bytes += static_cast<char>(static_cast<unsigned char>(n));
  const Ranks::Numbers numbers = Ranks::numbers_of(bytes);
  REQUIRE(numbers.size() == 256);
  for (int n = 0; n < 256; ++n) CHECK(numbers[static_cast<std::size_t>(n)] == n);
  CHECK(Ranks::bytes_of(numbers) == bytes);
  for (const double wrong : {-1.0, 256.0, std::nan("")}) {
    CHECK_THROWS_WITH(Ranks::bytes_of({wrong}), Catch::Matchers::ContainsSubstring("byte"));
  }
}

TEST_CASE("the values of rank 0 are adopted by all") {
  for (const auto& [values, error] : on_ranks(3, [](Team& team) {
         const auto own = static_cast<std::size_t>(team.rank());
         std::vector<fitting::DistancePoint> points(4 + own, {{1.0 * team.rank(), 2, 3}, 4});
         team.adopt(points);
         Map map = some_map();
         map.dynamics.log_scale += team.rank();
         team.adopt(map);
         return std::vector<double>{static_cast<double>(points.size()), points[3].position.x(),
                                    points[3].distance, map.dynamics.log_scale};
       })) {
    CHECK(error.empty());
    CHECK(values == std::vector<double>{4, 0, 4, 0.3});
  }
}

TEST_CASE("ranks go through the same stages; rank 0 alone decides when to stop") {
  const auto pool = test::sphere_pool(4000);
  const auto draw = [&](const fitting::Level& level, base::Random& random) {
    return pool.draw(level, random);
  };
  test::ToyProblem own(draw);
  own.on_distances = test::from_unit_sphere;
  const auto start = fitting::place_factors(kReference, pool, 8, 1);
  const fitting::Schedule schedule{30, 1e-3, {test::small_level()}};
  const fitting::Schedule endless{1'000'000, 1e-3, {test::small_level()}};
  struct Fitted {
    StopReason stopped = StopReason::converged;
    std::vector<double> unknowns;
  };
  const auto fitted = [&](Team& team, const fitting::Schedule& course, double time_limit,
                          std::stop_token stop) {
    FitOptions options;
    options.factors = 8;
    options.time_limit = team.broadcast({time_limit}).front();
    const fitting::DividedProblem problem(team, own, 3);
    fitting::FitPlan plan = test::plan_of(options, course);
    plan.budget = fitting::Budget(options, course.evaluations, 0,
                                  team.shared(fitting::start_clock(std::move(stop))));
    fitting::Stages stages(problem, start, std::move(plan));
    const StopReason stopped = stages.run();
    return Fitted{stopped, energy::to_unknowns(stages.finished().map)};
  };
  const double none = std::numeric_limits<double>::infinity();
  std::stop_source asked;
  asked.request_stop();

  const auto one = on_ranks(1, [&](Team& team) { return fitted(team, schedule, none, {}); });
  REQUIRE(one.front().error.empty());
  const auto same = [&](const auto& outcomes, StopReason reason) {
    for (const auto& [result, error] : outcomes) {
      CHECK(error.empty());
      CHECK(result.stopped == reason);
      CHECK(result.unknowns == outcomes.front().result.unknowns);
    }
  };
  for (const int size : {2, 3}) {
    const auto many = on_ranks(size, [&](Team& team) {
      // A stop request of another rank is not looked at.
      return fitted(team, schedule, none, team.rank() == 0 ? std::stop_token() : asked.get_token());
    });
    same(many, StopReason::schedule_done);
    CHECK(many.front().result.unknowns == one.front().result.unknowns);
  }
  same(on_ranks(
           2, [&](Team& team) { return fitted(team, endless, team.rank() == 0 ? 0.3 : none, {}); }),
       StopReason::time_limit);
  same(on_ranks(2,
                [&](Team& team) {
                  return fitted(team, endless, none,
                                team.rank() == 0 ? asked.get_token() : std::stop_token());
                }),
       StopReason::interrupted);
}

TEST_CASE("ranks whose devices round otherwise fit the first one's map together") {
  const auto pool = test::sphere_pool(4000);
  fitting::Level level = test::small_level();
  level.until = 0.5;
  fitting::Level polished = level;
  polished.until = 1;
  polished.relocated = 0;
  polished.iterations = 2;
  polished.loss = energy::Loss::tanh;
  const fitting::Schedule schedule{60, 1e-3, {level, polished}};
  FitOptions options;
  options.factors = 8;
  Map start = fitting::place_factors(kReference, pool, *options.factors, 1);
  start.dynamics.factors.push_back({{0.1, 0.2, 0, 0.01}, -0.3});  // misplaced
  // Every answer except the evaluators' is off by this relative error.
  const auto fitted = [&](Team& team, double error) {
    test::ToyProblem own([&](const fitting::Level& of, base::Random& random) {
      energy::Samples samples = pool.draw(of, random);
      for (double& target : samples.target) target += error;
      return samples;
    });
    own.on_distances = [&](const std::vector<Eigen::Vector3d>& points) {
      auto distances = test::from_unit_sphere(points);
      for (double& distance : distances) distance *= 1 - 1e4 * error;  // inside is outside
      return distances;
    };
    own.on_overlap = [&](const Map&, int) { return 0.5 + error; };
    own.on_finished = [&](Map map) {
      map.dynamics.log_scale += map.frame.detail ? 0 : error;
      map.frame.detail = 0.01;
      return map;
    };
    const fitting::DividedProblem problem(team, own, 3);
    fitting::Stages stages(problem, start, test::plan_of(options, schedule));
    stages.run();
    std::vector<double> found = energy::to_unknowns(stages.finished().map);
    for (const StageReport& report : stages.reports()) {
      found.insert(found.end(), {report.energy_before, report.energy_after, report.iou});
    }
    return found;
  };
  const auto alone = on_ranks(1, [&](Team& team) { return fitted(team, 0); });
  REQUIRE(alone.front().error.empty());
  for (const auto& [found, error] :
       on_ranks(3, [&](Team& team) { return fitted(team, 1e-3 * team.rank()); })) {
    CHECK(error.empty());
    CHECK(found == alone.front().result);
  }
}
