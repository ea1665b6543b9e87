// The factorised Gauss-Newton matrix, on the host and on the device, against its definition.

#include <catch2/catch_all.hpp>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>

#include "base/random.hpp"
#include "energy/device_factor.hpp"
#include "preconditioner_check.hpp"
#include "test_device.hpp"

using namespace qjulia;
using Eigen::Index;
using Eigen::MatrixXd;
using energy::CurvatureFactor;

namespace {

constexpr double kDamping = 1e-3;

/// Symmetric, its eigenvalues at least 1e-3 of the largest, its diagonal from 1e-4 to 1; exact in
/// single precision.
MatrixXd random_matrix(Index order) {
  base::Random random(static_cast<std::uint64_t>(order));
  MatrixXd half(order, order);
  for (double& entry : half.reshaped()) entry = random.uniform(-0.5, 1);
  MatrixXd matrix = half * half.transpose() / static_cast<double>(order);
  matrix.diagonal().array() += 1e-3;
  const Eigen::VectorXd size =
      Eigen::VectorXd::LinSpaced(order, 0, -2).unaryExpr([](double e) { return std::pow(10, e); });
  return MatrixXd(size.asDiagonal() * matrix * size.asDiagonal()).cast<float>().cast<double>();
}

/// L Lᵀ; NaN where L has them.
MatrixXd product(const CurvatureFactor& factor) {
  const Index n = factor.scale.size();
  const MatrixXd lower =
      factor.lower.topLeftCorner(n, n).cast<double>().triangularView<Eigen::Lower>();
  return lower * lower.transpose();
}

/// Uploads h / 2, its rows and columns scattered among other numbers, and returns `make` of it.
template <class Make>
auto on_device(const Device& device, const MatrixXd& h, const Make& make) {
  const auto n = static_cast<std::size_t>(h.rows());
  const std::size_t stride = n + 5;
  // As an evaluator has them: the first unknown last, a gap before it and one amid the others.
  std::vector<std::int32_t> place(n);
  for (std::size_t i = 0; i < n; ++i) {
    place[i] = static_cast<std::int32_t>(i == 0 ? stride - 1 : i <= n / 2 ? i - 1 : i + 1);
  }
  std::vector<double> rows(stride * stride, 7);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) {
      const auto [low, high] = std::minmax(place[i], place[j]);
      rows[static_cast<std::size_t>(low) * stride + static_cast<std::size_t>(high)] =
          0.5 * h(static_cast<Index>(i), static_cast<Index>(j));
    }
  }
  const auto sent = device.context().upload_real(rows, Precision::single);
  return make(energy::DeviceMatrix{sent, stride, place, Eigen::VectorXd::Constant(h.rows(), 2)});
}

std::optional<CurvatureFactor> on_device(const Device& device, const MatrixXd& h) {
  return on_device(device, h, [&](const energy::DeviceMatrix& matrix) {
    return energy::factorised(device, matrix, kDamping);
  });
}

std::unique_ptr<energy::Preconditioner> preconditioner_on_device(const Device& device,
                                                                 const MatrixXd& h) {
  return on_device(device, h, [&](const energy::DeviceMatrix& matrix) {
    return energy::make_preconditioner(device, matrix, kDamping);
  });
}

MatrixXd damped(const MatrixXd& h) {
  MatrixXd matrix = h;
  matrix.diagonal() *= 1 + kDamping;
  return matrix;
}

}  // namespace

TEST_CASE("the factor's product is the scaled matrix, on the host and on the device") {
  const test::Variant variant = GENERATE(from_range(test::variants()));
  // Whole blocks, one row more, and a part of a block.
  const Index order = GENERATE(384, 385, 700);
  const Device device = variant.of(test::shared_device());
  if (!test::can_check(device, Precision::dbl)) return;
  CAPTURE(variant, order);
  const MatrixXd h = random_matrix(order);
  const CurvatureFactor on_host = energy::factorised(h, kDamping);
  const auto found = on_device(device, h);
  REQUIRE(found);
  for (const CurvatureFactor& factor : {on_host, *found}) {
    const auto scale = factor.scale.asDiagonal();
    MatrixXd expected = scale * damped(h) * scale;
    CHECK((expected.diagonal().array() - 1).abs().maxCoeff() < 1e-4);
    expected.diagonal().setOnes();
    CHECK((product(factor) - expected).cwiseAbs().maxCoeff() < 3e-7);
  }
  CHECK((on_host.scale - found->scale).cwiseQuotient(on_host.scale).cwiseAbs().maxCoeff() < 1e-14);
  CHECK(product(*on_device(device, h)) == product(*found));
}

TEST_CASE("a preconditioner made on the device turns the matrix into the identity") {
  const Layout layout = GENERATE(Layout::cpu, Layout::gpu);
  const int width = GENERATE(1, 8, 16);
  const Index order = GENERATE(384, 385, 700);
  const Device device = test::shared_device().with_layout(layout).with_lane_width(width);
  if (!test::can_check(device, Precision::dbl)) return;
  CAPTURE(to_string(layout), width, order);
  const MatrixXd h = random_matrix(order);
  const auto found = preconditioner_on_device(device, h);
  REQUIRE(found);
  const auto [product, transposed] = test::error_of(*found, h, kDamping);
  CHECK(product < 3e-6);
  CHECK(transposed < 1e-6);
  const Eigen::VectorXd vector = Eigen::VectorXd::LinSpaced(order, -1, 2);
  const auto again = preconditioner_on_device(device, h);
  CHECK(again->move(vector) == found->move(vector));
  CHECK(again->gradient(vector) == found->gradient(vector));
}

TEST_CASE("a matrix that is not positive definite is damped until it is, alike in both places") {
  const test::Variant variant = GENERATE(from_range(test::variants()));
  const Device device = variant.of(test::shared_device());
  if (!test::can_check(device, Precision::dbl)) return;
  // A pair whose correlation is `more` than one: in the first block, across blocks, and the last.
  const auto [i, j] = GENERATE(table<Index, Index>({{0, 1}, {3, 300}, {398, 399}}));
  CAPTURE(variant, i, j);
  MatrixXd h = MatrixXd::Identity(400, 400);
  h(i, j) = h(j, i) = 1.05;
  const CurvatureFactor on_host = energy::factorised(h, kDamping);
  const auto found = on_device(device, h);
  REQUIRE(found);
  // 1.05 / (1 + λ) is too much by 4.9 %: a tenth is what suffices.
  const double left = 1.05 / (1 + kDamping) / 1.1;
  for (const CurvatureFactor& factor : {on_host, *found}) {
    CHECK(product(factor)(j, i) == Catch::Approx(left).epsilon(1e-6));
    CHECK(product(factor)(j, j) == Catch::Approx(1).epsilon(1e-6));
  }
  h(i, i) = std::numeric_limits<double>::quiet_NaN();
  CHECK_FALSE(on_device(device, h)->lower.topLeftCorner(400, 400).diagonal().allFinite());
}

TEST_CASE("small matrices are left to the host") {
  const Device device = test::shared_device();
  CHECK_FALSE(on_device(device, random_matrix(383)));
  CHECK_FALSE(preconditioner_on_device(device, random_matrix(383)));
  const CurvatureFactor one = energy::factorised(MatrixXd::Constant(1, 1, 4), kDamping);
  CHECK(one.scale[0] == Catch::Approx(0.5 / std::sqrt(1 + kDamping)));
  CHECK(one.lower(0, 0) == 1);
}
