#include "energy/curvature.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "base/large_pages.hpp"
#include "energy/panel_products.hpp"
#include "layout/panel_layout.h"
#include "qjulia/error.hpp"

namespace qjulia::energy {
namespace {

using device::narrow;
using Eigen::Index;

constexpr auto kBlock = std::size_t{QJ_CHOLESKY_BLOCK};
/// Below this order launches take longer than the work.
constexpr std::size_t kLeastOrder = 384;

/// `attempt(more)` for `more` of 1, 1 + λ, 1 + 10 λ … until it says that the matrix was positive
/// definite, or there is no use.
template <class Attempt>
void with_enough_damping(double damping, const Attempt& attempt) {
  bool is_positive = attempt(1.0);
  for (double more = damping; !is_positive && more < 1; more *= 10) is_positive = attempt(1 + more);
}

/// A matrix on its way to its factor on a device.
class DeviceFactorisation {
 public:
  DeviceFactorisation(const Device& device, const DeviceMatrix& h)
      : context_(device.context()),
        tuning_(device.tuning(Precision::dbl)),
        h_(h),
        n_(h.place.size()),
        order_((n_ + kBlock - 1) / kBlock * kBlock),
        place_(context_.upload(std::span<const std::int32_t>(h.place))),
        matrix_(context_.allocate_real(order_ * order_, Precision::dbl)),
        panels_(context_.allocate_real(kBlock * order_, Precision::dbl)),
        last_pivot_(context_.allocate_real(1, Precision::dbl)) {}

  Eigen::VectorXd diagonal() {
    const auto entries = context_.allocate_real(n_, Precision::dbl);
    context_.launch(kernel("diagonal"), {{n_, 1, 1}},
                    {narrow(n_), narrow(h_.order), place_, h_.rows, entries});
    Eigen::VectorXd values(static_cast<Index>(n_));
    context_.read(entries, {values.data(), n_});
    return values.cwiseProduct(h_.squared_scale);
  }

  /// @return whether it is positive definite with what is beside the diagonal divided by `more`.
  bool factorise(const Eigen::VectorXd& scale, double more) {
    const Eigen::VectorXd factors = scale.cwiseProduct(h_.squared_scale.cwiseSqrt());
    const auto sent = context_.upload_real({factors.data(), n_}, Precision::dbl);
    context_.launch(kernel("unit_diagonal"), {{order_, order_, 1}},
                    {narrow(n_), narrow(h_.order), place_, h_.rows, sent,
                     device::Argument::real(more, Precision::dbl), narrow(order_), matrix_});
    run_blocks();
    std::vector<double> pivot(1);
    context_.read(last_pivot_, pivot);
    return std::isfinite(pivot.front());
  }

  /// Narrowed on the device, and read by blocks of rows.
  Eigen::MatrixXf lower() {
    Eigen::MatrixXf rows(order_, order_);
    base::use_large_pages(rows.data(), order_ * order_ * sizeof(float));
    const auto block = context_.allocate_real(kBlock * order_, Precision::single);
    for (std::size_t first = 0; first < order_; first += kBlock) {
      context_.launch(kernel("narrowed"), {{order_, kBlock, 1}},
                      {narrow(order_), narrow(first), matrix_, block});
      context_.read(block, std::span<float>(rows.data() + first * order_, kBlock * order_));
    }
    return rows;
  }

 private:
  device::Kernel kernel(const char* name) const {
    return context_.kernel("cholesky.cl", name, {tuning_.lane_width, Precision::dbl, {}});
  }

  void run_blocks() {
    const auto triangle = kernel("cholesky_triangle");
    const auto rows = kernel("cholesky_rows");
    constexpr std::size_t kMembers = 64;
    const std::size_t members =
        std::clamp<std::size_t>(context_.largest_group(triangle), 1, kMembers);
    const auto width = static_cast<std::size_t>(tuning_.lane_width);
    PanelProducts products(context_, tuning_, Precision::dbl);
    for (std::size_t first = 0; first < order_; first += kBlock) {
      context_.launch(triangle, {{members, 1, 1}, {members, 1, 1}},
                      {narrow(order_), narrow(first), matrix_, last_pivot_});
      const std::size_t next = first + kBlock;
      if (next == order_) break;
      context_.launch(rows, {{(order_ - next) / width, 1, 1}, {}},
                      {narrow(order_), narrow(first), matrix_, panels_});
      products(panels_, kBlock, order_, next, PanelProducts::Update::subtract, matrix_);
    }
  }

  device::Context& context_;
  Tuning tuning_;
  const DeviceMatrix& h_;
  std::size_t n_;
  std::size_t order_;
  device::Buffer<std::int32_t> place_;
  device::RealBuffer matrix_, panels_, last_pivot_;
};

}  // namespace

Eigen::VectorXd unit_scale(const Eigen::VectorXd& diagonal, double damping) {
  const double floor = 1e-9 * diagonal.mean() + 1e-300;
  return (diagonal.array() * (1 + damping) + floor).sqrt().inverse();
}

CurvatureFactor factorised(const Eigen::MatrixXd& h, double damping) {
  const Eigen::VectorXd scale = unit_scale(h.diagonal(), damping);
  const Index n = h.rows();
  Eigen::MatrixXd matrix(n, n);
  with_enough_damping(damping, [&](double more) {
    for (Index j = 0; j < n; ++j) {
      const double by = scale[j] / more;
      for (Index i = j + 1; i < n; ++i) matrix(i, j) = h(i, j) * scale[i] * by;
      matrix(j, j) = 1;
    }
    const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>, Eigen::Lower> in_place(matrix);
    return in_place.info() == Eigen::Success;
  });
  return {scale, matrix.cast<float>()};
}

Eigen::VectorXd Preconditioner::move(const Eigen::VectorXd& u) const {
  if (factor_.lower.size() == 0) return u.cwiseProduct(factor_.scale);
  const Eigen::VectorXf solved =
      lower().transpose().triangularView<Eigen::Upper>().solve(u.cast<float>());
  return solved.cast<double>().cwiseProduct(factor_.scale);
}

Eigen::VectorXd Preconditioner::gradient(const Eigen::VectorXd& g) const {
  Eigen::VectorXd scaled = g.cwiseProduct(factor_.scale);
  if (factor_.lower.size() == 0) return scaled;
  return lower().triangularView<Eigen::Lower>().solve(scaled.cast<float>()).cast<double>();
}

Eigen::VectorXd CurvatureSum::faded(std::size_t factors, const std::vector<std::size_t>& moved) {
  const auto k = static_cast<Index>(factors);
  const bool is_first = weight.size() == 0;
  if (is_first) weight = Eigen::VectorXd::Zero(1 + 5 * k);
  Eigen::VectorXd kept = Eigen::VectorXd::Constant(1 + 5 * k, kKept);
  for (const std::size_t i : moved) {
    for (Index component = 0; component < 5; ++component) {
      kept[1 + component * k + static_cast<Index>(i)] = 0;
    }
  }
  weight = weight.cwiseProduct(kept).array() + 1;
  return is_first ? Eigen::VectorXd() : Eigen::VectorXd(kept.cwiseSqrt());
}

std::optional<CurvatureFactor> factorised(const Device& device, const DeviceMatrix& h,
                                          double damping) {
  if (!device.info().has_double || h.place.size() < kLeastOrder) return std::nullopt;
  CurvatureFactor result;
  std::optional<DeviceFactorisation> work;
  try {
    work.emplace(device, h);
    result.scale = unit_scale(work->diagonal(), damping);
    with_enough_damping(damping, [&](double more) { return work->factorise(result.scale, more); });
    result.lower = work->lower();
  } catch (const DeviceError& error) {
    if (!device::is_out_of_memory(error) && !device::is_refused_group(error)) throw;
    return std::nullopt;
  }
  return result;
}

}  // namespace qjulia::energy
