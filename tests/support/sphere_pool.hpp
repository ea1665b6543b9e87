#pragma once
/// What tests of a fit's parts share: a sphere to fit, small levels, budgets, plans.

#include <random>

#include "fit/budget.hpp"
#include "fit/sample_pool.hpp"
#include "fit/stages.hpp"
#include "random_maps.hpp"

namespace qjulia::test {

inline fitting::Budget budget_of(int evaluations, FitOptions options = {},
                                 std::stop_token stop = {}) {
  return {options, evaluations, 0, fitting::start_clock(std::move(stop))};
}

/// The plan of a fit without a checkpoint.
inline fitting::FitPlan plan_of(const FitOptions& options, const fitting::Schedule& schedule,
                                std::stop_token stop = {}) {
  return {options, schedule, budget_of(schedule.evaluations, options, std::move(stop)),
          fitting::Checkpoint({}, "")};
}

inline std::optional<fitting::FitState> kept_in(const fitting::Checkpoint& checkpoint) {
  return checkpoint.state_in(checkpoint.read());
}

/// 200 samples and 10 steps a stage, and a factor moved before each.
inline fitting::Level small_level() {
  fitting::Level level;
  level.samples = 200;
  level.band = 0.1;
  level.band_weight = 0.5;
  level.steps = 10;
  level.relocated = 1;
  return level;
}

/// Points about the unit sphere, where distances are known.
inline fitting::SamplePool sphere_pool(std::size_t count) {
  std::mt19937_64 bits(5);
  const auto direction = [&] {
    for (;;) {
      const Eigen::Vector3d x(uniform(bits, -1, 1), uniform(bits, -1, 1), uniform(bits, -1, 1));
      if (x.norm() > 0.1 && x.norm() < 1) return Eigen::Vector3d(x.normalized());
    }
  };
  fitting::SamplePool pool;
  pool.inradius = 1;
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3d n = direction();
    pool.surface.push_back({n, n});
    const double offset = uniform(bits, -0.25, 0.25);
    pool.near.push_back({(1 + offset) * n, offset});
    const Eigen::Vector3d x(uniform(bits, -2, 2), uniform(bits, -2, 2), uniform(bits, -2, 2));
    pool.around.push_back({x, x.norm() - 1});
    const double depth = uniform(bits, 0.1, 1);
    pool.deep.push_back({(1 - depth) * n, -depth});
  }
  return pool;
}

}  // namespace qjulia::test
