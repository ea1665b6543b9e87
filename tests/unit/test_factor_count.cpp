// How many factors a fit has when nobody says.

#include <catch2/catch_all.hpp>
#include <chrono>
#include <limits>
#include <thread>

#include "fit/factor_count.hpp"
#include "fit/placement.hpp"
#include "sphere_pool.hpp"

using namespace qjulia;
using namespace qjulia::fitting;

namespace {

/// Takes `seconds` for an evaluation and next to none for all else.
class Slow final : public Evaluator {
 public:
  explicit Slow(double seconds) : pause_(seconds) {}

  Evaluation evaluate(const Map& map, bool /*with_gradient*/) override {
    std::this_thread::sleep_for(pause_);
    return {0, std::vector<double>(1 + 5 * map.dynamics.factors.size())};
  }
  std::vector<double> field(const Map& /*map*/) override { return {}; }
  Eigen::MatrixXd gauss_newton(const Map& map) override {
    const auto n = static_cast<Eigen::Index>(1 + 5 * map.dynamics.factors.size());
    return Eigen::MatrixXd::Identity(n, n);
  }
  BlockCurvature gauss_newton_blocks(const Map& /*map*/, const NeighbourBlocks& blocks) override {
    BlockCurvature result{blocks, {}, Eigen::MatrixXd::Identity(1, 1)};
    for (const auto& block : blocks) {
      const auto order = static_cast<Eigen::Index>(5 * block.size());
      result.own.emplace_back(Eigen::MatrixXd::Identity(order, order));
    }
    const auto order = static_cast<Eigen::Index>(1 + 5 * blocks.size());
    result.coarse = Eigen::MatrixXd::Identity(order, order);
    return result;
  }
  Eigen::VectorXd gauss_newton_diagonal(const Map& map) override {
    return Eigen::VectorXd::Ones(static_cast<Eigen::Index>(1 + 5 * map.dynamics.factors.size()));
  }
  Eigen::MatrixXd pursuit_products(const Map& /*map*/,
                                   const std::vector<Quaternion>& centers) override {
    const auto n = static_cast<Eigen::Index>(2 + centers.size());
    return Eigen::MatrixXd::Identity(n, n);
  }

 private:
  std::chrono::duration<double> pause_;
};

Schedule schedule() {
  Schedule schedule;
  schedule.evaluations = 6000;
  schedule.levels = {test::small_level()};
  schedule.automatic = {700, 1500, 12};
  return schedule;
}

int chosen(const FitOptions& options, double seconds_of_evaluation = 0,
           const Schedule& schedule = ::schedule(),
           const SamplePool& pool = test::sphere_pool(4000)) {
  auto budget = test::budget_of(planned_evaluations(options, schedule), options);
  const auto make = [&](const Samples&, const EnergySettings&) {
    return std::make_unique<Slow>(seconds_of_evaluation);
  };
  return chosen_factors(options, schedule, make, pool, budget);
}

}  // namespace

TEST_CASE("the number of factors is the caller's, or the schedule's, or follows evaluations") {
  FitOptions options;
  CHECK(chosen(options) == 700);
  CHECK(planned_evaluations(options, schedule()) == 1500);
  options.max_factors = 200;
  CHECK(chosen(options) == 200);
  options.max_factors = 1000;
  options.max_evaluations = 750;
  CHECK(chosen(options) == 350);
  CHECK(planned_evaluations(options, schedule()) == 750);
  options.max_evaluations = 1;
  CHECK(chosen(options) == 64);
  Schedule small = schedule();
  small.automatic.factors = 10;  // fewer than 64 from the start
  CHECK(chosen(options, 0, small) == 10);
  options.factors = 50;
  CHECK(chosen(options) == 50);
  options.max_evaluations.reset();
  CHECK(planned_evaluations(options, schedule()) == 6000);
}

TEST_CASE("with a time limit the number of factors follows how long a stage takes") {
  FitOptions options;
  options.time_limit = 20;
  CHECK(planned_evaluations(options, schedule()) == 6000);
  // A stage has ten steps, and a step 1.1 evaluations. Twelve stages in 20 s: 0.15 s for one
  // evaluation, 0.1 s with 320 factors.
  const int factors = chosen(options, 0.1);
  CHECK(factors > 380);
  CHECK(factors < 500);
  options.time_limit = 3;
  CHECK(chosen(options, 0.1) == 64);
}

TEST_CASE("a shape with little room has as many factors as find a place") {
  const SamplePool pool = test::sphere_pool(150);
  const int most = most_factors(pool);
  CHECK(most > 64);
  CHECK(most < 700);
  FitOptions options;
  CHECK(chosen(options, 0, schedule(), pool) == most);
  options.time_limit = 20;
  CHECK(most < 320);  // with which a stage would be timed
  CHECK(chosen(options, 0, schedule(), pool) > 64);
  const auto make = [](const Samples&, const EnergySettings&) { return std::make_unique<Slow>(0); };
  CHECK_NOTHROW(place_factors(make, pool, most, 1));
  CHECK_THROWS(place_factors(make, pool, most + 10, 1));
}

TEST_CASE("a shape without room for the fewest factors of a map is refused") {
  SamplePool pool = test::sphere_pool(150);
  pool.deep.resize(2);
  std::erase_if(pool.near, [](const DistancePoint& p) { return p.distance < 0; });
  std::erase_if(pool.around, [](const DistancePoint& p) { return p.distance < 0; });
  FitOptions options;
  for (const double limit : {20.0, std::numeric_limits<double>::infinity()}) {
    options.time_limit = limit;
    CHECK_THROWS_WITH(chosen(options, 0, schedule(), pool),
                      Catch::Matchers::ContainsSubstring("room for"));
  }
}
