// What a fit may spend, and what may be asked of it.

#include <catch2/catch_all.hpp>
#include <cmath>
#include <limits>
#include <stop_token>
#include <thread>

#include "base/deadline.hpp"
#include "fit/budget.hpp"
#include "qjulia/base/error.hpp"
#include "sphere_pool.hpp"

using namespace qjulia;
using test::budget_of;

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

  FitOptions limited;
  limited.time_limit = 100;
  auto resumed = budget_of(100, limited);
  resumed.carry(30, 250);
  CHECK_FALSE(resumed.spent());
  CHECK(resumed.time_left() == Catch::Approx(100).margin(1));

  std::stop_source source;
  auto interrupted = budget_of(100, {}, source.get_token());
  CHECK_FALSE(interrupted.spent());
  source.request_stop();
  CHECK_FALSE(interrupted.spent());
  interrupted.update();
  CHECK(interrupted.spent() == StopReason::interrupted);
}

namespace {

Map map_of(std::size_t factors) {
  Map map;
  map.dynamics.factors.resize(factors, {{}, 1});
  return map;
}

}  // namespace

TEST_CASE("fit options that make no sense are refused by name") {
  const auto refused = [](auto change, const std::string& field) {
    FitOptions options;
    change(options);
    try {
      options.validate();
      FAIL("nothing was refused");
    } catch (const OptionError& error) {
      CHECK(error.field() == field);
    }
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  refused([](FitOptions& o) { o.factors = 7; }, "factors");
  refused([](FitOptions& o) { o.max_factors = 0; }, "max_factors");
  refused([](FitOptions& o) { o.factors = 1'000'000; }, "factors");
  refused([&](FitOptions& o) { o.detail = nan; }, "detail");
  refused([](FitOptions& o) { o.detail = -1.0; }, "detail");
  refused([](FitOptions& o) { o.detail = 0.11; }, "detail");
  refused([](FitOptions& o) { o.detail = 0.00009; }, "detail");
  refused([](FitOptions& o) { o.steepness = 0.99; }, "steepness");
  refused([&](FitOptions& o) { o.steepness = nan; }, "steepness");
  refused([](FitOptions& o) { o.time_limit = -5; }, "time_limit");
  refused([&](FitOptions& o) { o.time_limit = nan; }, "time_limit");
  refused([](FitOptions& o) { o.max_evaluations = -1; }, "max_evaluations");
  refused([](FitOptions& o) { o.target_iou = 0; }, "target_iou");
  refused([](FitOptions& o) { o.target_iou = 1.01; }, "target_iou");
  refused([](FitOptions& o) { o.target_iou = std::nan(""); }, "target_iou");
  refused([](FitOptions& o) { o.schedule = "nonesuch"; }, "schedule");
  refused([](FitOptions& o) { o.initial = quadratic_map({}); }, "initial");
  refused([](FitOptions& o) { o.initial = map_of(7); }, "initial");
  refused(
      [](FitOptions& o) {
        o.initial = map_of(9);
        o.factors = 10;
      },
      "factors");
  FitOptions options;
  options.initial.emplace();  // without factors
  CHECK_THROWS_AS(options.validate(), InputError);
  options.initial = map_of(8);
  options.factors = 8;
  CHECK_NOTHROW(options.validate());
  options.schedule = "nonesuch";
  options.schedule_text = "evaluations = ";
  CHECK_THROWS_WITH(options.validate(), Catch::Matchers::ContainsSubstring("schedule_text"));
  options.schedule_text = schedule_text("fast");
  CHECK_NOTHROW(options.validate());
  CHECK_NOTHROW(FitOptions{}.validate());
}

TEST_CASE("a mesh is measured with as many triangles as the time limit has room for") {
  CHECK(fitting::most_triangles(1e-3) == fitting::most_triangles(1));
  CHECK(fitting::most_triangles(1) < 20'000);
  CHECK(fitting::most_triangles(std::numeric_limits<double>::infinity()) ==
        std::numeric_limits<double>::infinity());
  CHECK(fitting::least_limit(100) == 0);
  CHECK(fitting::most_triangles(fitting::least_limit(2e6 + 1)) > 2e6);
}

TEST_CASE("a deadline stops work when another request or the clock does") {
  const double never = std::numeric_limits<double>::infinity();
  std::stop_source source;
  const base::Deadline endless(source.get_token(), never), late(source.get_token(), 1e6);
  CHECK_FALSE(endless.token().stop_requested());
  CHECK_FALSE(late.token().stop_requested());
  const base::Deadline passed(source.get_token(), -1);
  while (!passed.token().stop_requested()) std::this_thread::yield();
  CHECK_FALSE(source.stop_requested());
  source.request_stop();
  CHECK(endless.token().stop_requested());
  CHECK(late.token().stop_requested());
}
