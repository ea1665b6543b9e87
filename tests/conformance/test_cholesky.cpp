// Cholesky's factorisation on the device against its definition and against Eigen's.

#include <Eigen/Cholesky>
#include <catch2/catch.hpp>
#include <limits>
#include <random>

#include "base/random.hpp"
#include "fit/cholesky.hpp"
#include "test_device.hpp"

using namespace qjulia;
using Eigen::Index;
using Eigen::MatrixXd;

namespace {

/// Symmetric, with eigenvalues of at least 1e-3 beside others of about `order`.
MatrixXd random_matrix(Index order) {
  base::Random random(static_cast<std::uint64_t>(order));
  MatrixXd half(order, order);
  for (double& entry : half.reshaped()) entry = random.uniform(-0.5, 1);
  MatrixXd matrix = half * half.transpose() / static_cast<double>(order);
  matrix.diagonal().array() += 1e-3;
  return matrix;
}

MatrixXd lower(const MatrixXd& matrix) { return matrix.triangularView<Eigen::Lower>(); }

}  // namespace

TEST_CASE("the Cholesky factor on the device is that of the definition") {
  const test::Variant variant = GENERATE(from_range(test::variants()));
  // Two that the host keeps; whole blocks, one row more, and a part of a block.
  const Index order = GENERATE(1, 383, 384, 385, 700);
  const Device device = variant.of(test::device());
  if (!test::can_check(device, Precision::dbl)) return;
  CAPTURE(variant, order);
  const MatrixXd matrix = random_matrix(order);
  MatrixXd factor = matrix;
  REQUIRE(fitting::cholesky(device, factor));
  const MatrixXd l = lower(factor);
  CHECK((l * l.transpose() - matrix).cwiseAbs().maxCoeff() < 1e-13 * matrix.cwiseAbs().maxCoeff());
  CHECK((l - MatrixXd(matrix.llt().matrixL())).cwiseAbs().maxCoeff() < 1e-9);
  CHECK(factor.triangularView<Eigen::StrictlyUpper>().toDenseMatrix() ==
        matrix.triangularView<Eigen::StrictlyUpper>().toDenseMatrix());
  MatrixXd again = matrix;
  REQUIRE(fitting::cholesky(device, again));
  CHECK(again == factor);
}

TEST_CASE("matrices that are not positive definite are found wherever the pivot is") {
  const test::Variant variant = GENERATE(from_range(test::variants()));
  const Device device = variant.of(test::device());
  if (!test::can_check(device, Precision::dbl)) return;
  const Index at = GENERATE(0, 127, 128, 399);
  CAPTURE(variant, at);
  const MatrixXd good = random_matrix(400);
  MatrixXd bad = good;
  bad(at, at) = -1;
  CHECK_FALSE(fitting::cholesky(device, bad));
  bad = good;
  bad(at, at) = std::numeric_limits<double>::quiet_NaN();
  CHECK_FALSE(fitting::cholesky(device, bad));
}
