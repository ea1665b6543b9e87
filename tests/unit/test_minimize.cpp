// Scaling, coarse spaces and the minimiser, on a quadratic energy.

#include <catch2/catch_all.hpp>
#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>

#include "fit/minimize.hpp"
#include "qjulia/base/error.hpp"
#include "sphere_pool.hpp"

using namespace qjulia;
using test::budget_of;

namespace {

/// E = ½ (v − goal)ᵀ A (v − goal) over the unknowns, A diagonal and badly scaled.
class Quadratic final : public energy::Evaluator {
 public:
  explicit Quadratic(const Map& goal) : goal_(energy::to_unknowns(goal)) {}

  energy::Evaluation evaluate(const Map& map, bool) override {
    const auto v = energy::to_unknowns(map);
    energy::Evaluation result;
    for (std::size_t i = 0; i < v.size(); ++i) {
      const double d = v[i] - goal_[i];
      result.energy += 0.5 * weight(i) * d * d;
      result.gradient.push_back(weight(i) * d);
    }
    return result;
  }
  Eigen::VectorXd gauss_newton_diagonal(const Map& map) override {
    return gauss_newton(map).diagonal();
  }
  Eigen::MatrixXd pursuit_products(const Map&, const std::vector<Quaternion>&) override {
    return {};
  }
  std::vector<double> field(const Map&) override { return {}; }
  Eigen::MatrixXd gauss_newton(const Map&) override {
    const auto n = static_cast<Eigen::Index>(goal_.size());
    Eigen::MatrixXd h = Eigen::MatrixXd::Zero(n, n);
    for (Eigen::Index i = 0; i < n; ++i) h(i, i) = weight(static_cast<std::size_t>(i));
    return h;
  }
  energy::BlockCurvature gauss_newton_blocks(const Map&, const energy::NeighbourBlocks&) override {
    return {};
  }

 private:
  static double weight(std::size_t i) { return std::pow(10.0, static_cast<double>(i % 7)); }
  std::vector<double> goal_;
};

fitting::Evaluate by(energy::Evaluator& energy) {
  return [&energy](const Map& map) { return energy.evaluate(map, true); };
}

fitting::Level level_of(fitting::Space space) {
  fitting::Level level;
  level.space = space;
  return level;
}

}  // namespace

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
  const auto scaling = energy::preconditioner_of(energy::factorised(h, kDamping));
  Eigen::MatrixXd damped = h;
  damped.diagonal() *= 1 + kDamping;
  // R⁻ᵀ (H + λ diag H) R⁻¹ = I, tried on unit vectors.
  for (Eigen::Index i = 0; i < kOrder; ++i) {
    const Eigen::VectorXd unit = Eigen::VectorXd::Unit(kOrder, i);
    const Eigen::VectorXd back = scaling->gradient(damped * scaling->move(unit));
    CHECK((back - unit).cwiseAbs().maxCoeff() < 1e-3);
  }
}

TEST_CASE("the minimiser finds a badly scaled minimum and moves only what the space holds") {
  const auto start = test::random_map(9, 0.1, 0.5, 1);
  const auto goal = test::random_map(9, 0.1, 0.5, 2);
  Quadratic energy(goal);
  const auto minimized = [&](const fitting::Subspace& subspace, fitting::Budget budget) {
    const auto scaling = energy::preconditioner_of(
        energy::factorised(subspace.restricted_matrix(energy.gauss_newton(start)), 1e-3));
    return fitting::minimize(by(energy), start, subspace, *scaling, 50, budget);
  };
  const fitting::Subspace all(start, level_of(fitting::Space::all), Unknowns::all);
  const auto found = minimized(all, budget_of(100));
  CHECK(found.energy_after < 1e-10 * found.energy_before);
  CHECK_FALSE(found.stopped);

  for (const fitting::Subspace& exponents :
       {fitting::Subspace(start, level_of(fitting::Space::exponents), Unknowns::all),
        fitting::Subspace(start, level_of(fitting::Space::all), Unknowns::exponents)}) {
    const auto part = minimized(exponents, budget_of(100));
    for (std::size_t k = 0; k < 9; ++k) {
      CHECK(part.map.dynamics.factors[k].center == start.dynamics.factors[k].center);
      CHECK(part.map.dynamics.factors[k].exponent ==
            Catch::Approx(goal.dynamics.factors[k].exponent).epsilon(1e-4));
    }
  }

  // From its diagonal alone, which is the whole of this matrix.
  auto budget = budget_of(100);
  const auto diagonal = energy::preconditioner_of_diagonal(
      all.restricted_diagonal(energy.gauss_newton_diagonal(start)), 1e-3);
  CHECK(fitting::minimize(by(energy), start, all, *diagonal, 50, budget).energy_after <
        1e-10 * found.energy_before);

  const auto ended = minimized(all, budget_of(1));
  CHECK(ended.stopped == StopReason::schedule_done);
  CHECK(ended.energy_after == energy.evaluate(start, false).energy);
  CHECK(energy::to_unknowns(ended.map) == energy::to_unknowns(start));
}

TEST_CASE("steps that take many evaluations end the run, with the lowest energy found") {
  const auto start = test::random_map(9, 0.1, 0.5, 1);
  Quadratic energy(test::random_map(9, 0.1, 0.5, 2));
  // Seven of eight trial steps seem to rise, so that each step is cut time and again.
  int evaluations = 0;
  const auto rough = [&](const Map& map) {
    auto evaluation = energy.evaluate(map, true);
    if (evaluations++ % 8 != 0) evaluation.energy += 1e6;
    return evaluation;
  };
  auto budget = budget_of(1000);
  const fitting::Subspace all(start, level_of(fitting::Space::all), Unknowns::all);
  const auto scaling = energy::preconditioner_of_diagonal(Eigen::VectorXd::Ones(all.size()), 1e-3);
  const auto found = fitting::minimize(rough, start, all, *scaling, 10, budget);
  CHECK_FALSE(found.stopped);
  CHECK(budget.evaluations() == 30);
  CHECK(found.energy_after < found.energy_before);
}

TEST_CASE("without a finite energy the map stays what it was, and the budget is obeyed") {
  const auto start = test::random_map(9, 0.1, 0.5, 1);
  const auto nothing = [](const Map& map) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    return energy::Evaluation{nan, std::vector<double>(1 + 5 * map.dynamics.factors.size(), nan)};
  };
  const fitting::Subspace all(start, level_of(fitting::Space::all), Unknowns::all);
  const auto scaling = energy::preconditioner_of_diagonal(Eigen::VectorXd::Ones(all.size()), 1e-3);
  auto budget = budget_of(2);
  const auto found = fitting::minimize(nothing, start, all, *scaling, 50, budget);
  CHECK(budget.evaluations() <= 2);
  CHECK(energy::to_unknowns(found.map) == energy::to_unknowns(start));
}

TEST_CASE("errors of the evaluator are not taken for the end of a line search") {
  const auto start = test::random_map(9, 0.1, 0.5, 1);
  Quadratic energy(test::random_map(9, 0.1, 0.5, 2));
  const fitting::Subspace all(start, level_of(fitting::Space::all), Unknowns::all);
  // Not the matrix, so that three evaluations do not suffice.
  const auto scaling = energy::preconditioner_of_diagonal(Eigen::VectorXd::Ones(all.size()), 1e-3);
  const auto minimized_with = [&](const std::function<void()>& fail) {
    int evaluations = 0;
    const auto failing = [&](const Map& map) {
      if (++evaluations == 3) fail();
      return energy.evaluate(map, true);
    };
    auto budget = budget_of(100);
    return fitting::minimize(failing, start, all, *scaling, 50, budget);
  };
  CHECK_THROWS_AS(minimized_with([] { throw std::logic_error("ours"); }), std::logic_error);
  CHECK_THROWS_AS(minimized_with([] { throw std::runtime_error("ours"); }), std::runtime_error);
  CHECK_THROWS_AS(minimized_with([] { throw DeviceError("toy", "clFinish", -5); }), DeviceError);
  CHECK_NOTHROW(minimized_with([] {}));
}

TEST_CASE("coarse spaces scale exponents and move centres by groups") {
  auto map = test::random_map(40, 0.1, 0.5, 4);
  const auto moved = [&](const fitting::Subspace& space, Eigen::Index variable) {
    auto unknowns = energy::to_unknowns(map);
    const Eigen::VectorXd move = space.prolonged(Eigen::VectorXd::Unit(space.size(), variable));
    for (std::size_t i = 0; i < unknowns.size(); ++i) {
      unknowns[i] += 0.1 * move[static_cast<Eigen::Index>(i)];
    }
    return energy::with_unknowns(map, unknowns);
  };
  const fitting::Subspace scalars(map, level_of(fitting::Space::scalars), Unknowns::all);
  REQUIRE(scalars.size() == 3);
  CHECK(moved(scalars, 0).dynamics.log_scale == Catch::Approx(map.dynamics.log_scale + 0.1));
  for (const bool roots : {true, false}) {
    const auto scaled = moved(scalars, roots ? 1 : 2);
    for (std::size_t k = 0; k < map.dynamics.factors.size(); ++k) {
      const double a = map.dynamics.factors[k].exponent;
      CHECK(scaled.dynamics.factors[k].exponent ==
            Catch::Approx(a * ((a > 0) == roots ? 1.1 : 1.0)));
      CHECK(scaled.dynamics.factors[k].center == map.dynamics.factors[k].center);
    }
  }

  fitting::Level level = level_of(fitting::Space::clusters);
  level.clusters = 10;
  const fitting::Subspace clusters(map, level, Unknowns::all);
  CHECK(clusters.size() > 1 + 5 * 8);
  CHECK(clusters.size() <= 1 + 5 * 10);
  CHECK(fitting::Subspace(map, level, Unknowns::exponents).size() == 1 + (clusters.size() - 1) / 5);
  // Every factor's X is moved by one variable, as far as its whole cluster's.
  std::size_t movers = 0;
  for (Eigen::Index v = 2; v < clusters.size(); v += 5) {
    const auto shifted = moved(clusters, v);
    for (std::size_t k = 0; k < map.dynamics.factors.size(); ++k) {
      const double change = shifted.dynamics.factors[k].center.x - map.dynamics.factors[k].center.x;
      if (change == 0) continue;
      ++movers;
      CHECK(change == Catch::Approx(0.1));
    }
  }
  CHECK(movers == map.dynamics.factors.size());

  // Gradients and matrices are restricted by the same P.
  const Eigen::VectorXd g = Eigen::VectorXd::LinSpaced(1 + 5 * 40, -1, 2);
  const Eigen::VectorXd y = Eigen::VectorXd::LinSpaced(clusters.size(), 0.5, -1);
  CHECK(clusters.restricted_gradient(g).dot(y) == Catch::Approx(g.dot(clusters.prolonged(y))));
  const Eigen::MatrixXd h = g.cwiseAbs2().asDiagonal();
  CHECK(y.dot(clusters.restricted_matrix(h) * y) ==
        Catch::Approx(clusters.prolonged(y).dot(h * clusters.prolonged(y))));
  CHECK((clusters.restricted_matrix(h).diagonal() - clusters.restricted_diagonal(g.cwiseAbs2()))
            .cwiseAbs()
            .maxCoeff() < 1e-12);
}
