#include "energy/device_factor.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "base/large_pages.hpp"
#include "device/context.hpp"
#include "energy/panel_products.hpp"
#include "layout/panel_layout.h"
#include "layout/triangle_layout.h"
#include "qjulia/error.hpp"

namespace qjulia::energy {
namespace {

using device::narrow;
using device::RealBuffer;
using Eigen::Index;
using Eigen::VectorXd;

constexpr auto kBlock = std::size_t{QJ_CHOLESKY_BLOCK};
/// Below this order launches take longer than the work.
constexpr std::size_t kLeastOrder = 384;

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

  /// R in single precision, order() rows. Entries below the diagonal are undefined.
  device::RealBuffer upper() {
    auto rows = context_.allocate_real(order_ * order_, Precision::single);
    context_.launch(kernel("narrowed"), {{order_, order_, 1}}, {narrow(order_), 0, matrix_, rows});
    return rows;
  }

  std::size_t order() const { return order_; }

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

/// R⁻¹ on a device, in single precision.
class InversePreconditioner final : public Preconditioner {
 public:
  /// @param upper R, order × order by rows, whose entries beyond n are the identity's.
  InversePreconditioner(const Device& device, VectorXd scale, const RealBuffer& upper,
                        std::size_t order)
      : device_(device),
        scale_(std::move(scale)),
        order_(order),
        inverse_(context().allocate_real(order * order, Precision::single)),
        vector_(context().allocate_real(order, Precision::single)),
        parts_(context().allocate_real(QJ_TRIANGLE_PARTS * order, Precision::single)),
        product_(context().allocate_real(order, Precision::single)) {
    const auto width = static_cast<std::size_t>(device_.lane_width(Precision::single));
    const auto rows = kernel("triangle.cl", "inverse_rows");
    const auto triangle = kernel("triangle.cl", "inverse_triangle");
    for (std::size_t first = order; first > 0;) {
      first -= kBlock;
      const std::size_t columns = (order - first) / width;
      const auto right = static_cast<double>(order - first - kBlock);
      const double work = static_cast<double>(kBlock) * right * (right + 1) / 2;
      context().launch(rows, {{columns, kBlock / QJ_INVERSE_ROWS, 1}},
                       {narrow(order), narrow(first), upper, inverse_}, work);
      context().launch(triangle, {{columns, 1, 1}},
                       {narrow(order), narrow(first), upper, inverse_});
    }
    // What the device lacks for products is found out here. It also waits for the inverse.
    gradient(move(VectorXd::Zero(scale_.size())));
  }

  VectorXd move(const VectorXd& u) const override {
    return product("triangle_times", {{QJ_TRIANGLE_PARTS, order_, 1}}, u).cwiseProduct(scale_);
  }

  VectorXd gradient(const VectorXd& g) const override {
    return product("transposed_triangle_times", {{order_, QJ_TRIANGLE_PARTS, 1}},
                   g.cwiseProduct(scale_));
  }

 private:
  device::Context& context() const { return device_.context(); }

  device::Kernel kernel(const char* file, const char* name) const {
    return context().kernel(file, name,
                            {device_.lane_width(Precision::single), Precision::single, {}});
  }

  VectorXd product(const char* parts_of, const device::Range& range, const VectorXd& vector) const {
    const Index n = vector.size();
    VectorXd values = VectorXd::Zero(static_cast<Index>(order_));
    values.head(n) = vector;
    context().write(vector_, std::span<const double>(values.data(), order_));
    context().launch(kernel("triangle.cl", parts_of), range,
                     {narrow(order_), inverse_, vector_, parts_});
    context().launch(kernel("reduce.cl", "sum_row_blocks"), {{order_, 1, 1}},
                     {parts_, QJ_TRIANGLE_PARTS, narrow(order_), QJ_TRIANGLE_PARTS, product_});
    context().read(product_, std::span<double>(values.data(), order_));
    return values.head(n);
  }

  Device device_;
  VectorXd scale_;  ///< S, n
  std::size_t order_;
  RealBuffer inverse_, vector_, parts_, product_;
};

/// Factorises H and returns `use(factorisation, S)`, or an empty result where `factorised` returns
/// nothing.
template <class Result, class Use>
Result with_factor(const Device& device, const DeviceMatrix& h, double damping, const Use& use) {
  if (!device.info().has_double || h.place.size() < kLeastOrder) return {};
  try {
    DeviceFactorisation work(device, h);
    const VectorXd scale = unit_scale(work.diagonal(), damping);
    with_enough_damping(damping, [&](double more) { return work.factorise(scale, more); });
    return use(work, scale);
  } catch (const DeviceError& error) {
    if (!device::is_out_of_memory(error) && !device::is_refused_group(error)) throw;
    return {};
  }
}

}  // namespace

std::optional<CurvatureFactor> factorised(const Device& device, const DeviceMatrix& h,
                                          double damping) {
  return with_factor<std::optional<CurvatureFactor>>(
      device, h, damping, [](DeviceFactorisation& work, const VectorXd& scale) {
        return CurvatureFactor{scale, work.lower()};
      });
}

std::unique_ptr<Preconditioner> make_preconditioner(const Device& device, const DeviceMatrix& h,
                                                    double damping) {
  if (device.layout() == Layout::cpu) {
    auto factor = factorised(device, h, damping);
    return factor ? preconditioner_of(*std::move(factor)) : nullptr;
  }
  return with_factor<std::unique_ptr<Preconditioner>>(
      device, h, damping,
      [&](DeviceFactorisation& work, const VectorXd& scale) -> std::unique_ptr<Preconditioner> {
        try {
          return std::make_unique<InversePreconditioner>(device, scale, work.upper(), work.order());
        } catch (const DeviceError& error) {
          if (!device::is_out_of_memory(error)) throw;
          return preconditioner_of({scale, work.lower()});
        }
      });
}

}  // namespace qjulia::energy
