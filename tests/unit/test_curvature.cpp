// Cholesky factors of Gauss-Newton matrices against their definition.

#include <catch2/catch_all.hpp>
#include <cmath>
#include <limits>

#include "energy/curvature.hpp"
#include "random_maps.hpp"

using namespace qjulia;
using Eigen::Index;
using Eigen::MatrixXd;
using energy::CurvatureFactor;

namespace {

constexpr double kDamping = 1e-3;

/// Symmetric, its eigenvalues at least 1e-3 of the largest, its diagonal from 1e-4 to 1.
MatrixXd random_matrix(Index order) {
  std::mt19937_64 bits(static_cast<std::uint64_t>(order));
  MatrixXd half(order, order);
  for (double& entry : half.reshaped()) entry = test::uniform(bits, -0.5, 1);
  MatrixXd matrix = half * half.transpose() / static_cast<double>(order);
  matrix.diagonal().array() += 1e-3;
  const Eigen::VectorXd size =
      Eigen::VectorXd::LinSpaced(order, 0, -2).unaryExpr([](double e) { return std::pow(10, e); });
  return size.asDiagonal() * matrix * size.asDiagonal();
}

/// L Lᵀ; NaN where L has them.
MatrixXd product(const CurvatureFactor& factor) {
  const MatrixXd lower = factor.lower.cast<double>().triangularView<Eigen::Lower>();
  return lower * lower.transpose();
}

}  // namespace

TEST_CASE("the factor's product is the scaled matrix") {
  for (const Index order : {1, 2, 40, 310}) {
    CAPTURE(order);
    const MatrixXd h = random_matrix(order);
    const CurvatureFactor factor = energy::factorised(h, kDamping);
    MatrixXd damped = h;
    damped.diagonal() *= 1 + kDamping;
    const auto scale = factor.scale.asDiagonal();
    MatrixXd expected = scale * damped * scale;
    CHECK((expected.diagonal().array() - 1).abs().maxCoeff() < 1e-4);
    expected.diagonal().setOnes();
    CHECK((product(factor) - expected).cwiseAbs().maxCoeff() < 3e-7);
  }
  const CurvatureFactor one = energy::factorised(MatrixXd::Constant(1, 1, 4), kDamping);
  CHECK(one.scale[0] == Catch::Approx(0.5 / std::sqrt(1 + kDamping)));
  CHECK(one.lower(0, 0) == 1);
}

TEST_CASE("a matrix that is not positive definite is damped until it is") {
  // A pair whose correlation is more than one.
  const auto [i, j] = GENERATE(table<Index, Index>({{0, 1}, {3, 300}, {398, 399}}));
  CAPTURE(i, j);
  MatrixXd h = MatrixXd::Identity(400, 400);
  h(i, j) = h(j, i) = 1.05;
  const CurvatureFactor factor = energy::factorised(h, kDamping);
  // 1.05 / (1 + λ) is too much by 4.9 %: a tenth is what suffices.
  const double left = 1.05 / (1 + kDamping) / 1.1;
  CHECK(product(factor)(j, i) == Catch::Approx(left).epsilon(1e-6));
  CHECK(product(factor)(j, j) == Catch::Approx(1).epsilon(1e-6));
  h(i, i) = std::numeric_limits<double>::quiet_NaN();
  CHECK_FALSE(energy::factorised(h, kDamping).lower.diagonal().allFinite());
}
