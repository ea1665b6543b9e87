#include "fit/cholesky.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <vector>

#include "device/refused.hpp"
#include "fit/panel_products.hpp"
#include "layout/panel_layout.h"
#include "qjulia/error.hpp"

namespace qjulia::fitting {
namespace {

using Eigen::Index;

constexpr auto kBlock = std::size_t{QJ_CHOLESKY_BLOCK};
/// Below this order launches take longer than the work.
constexpr Index kLeastOrder = 384;

/// Of the order's next multiple of blocks: the lower triangle by columns, which is the upper one by
/// rows, and then rows of the identity.
std::vector<double> padded(const Eigen::MatrixXd& matrix, std::size_t order) {
  std::vector<double> rows(order * order, 0.0);
  const auto n = static_cast<std::size_t>(matrix.rows());
  for (std::size_t j = 0; j < n; ++j) {
    const double* column = matrix.data() + j * n;
    std::copy(column + j, column + n, rows.begin() + static_cast<std::ptrdiff_t>(j * order + j));
  }
  for (std::size_t j = n; j < order; ++j) rows[j * order + j] = 1;
  return rows;
}

void factorise(device::Context& context, const Tuning& tuning, std::size_t order,
               const device::RealBuffer& matrix) {
  const device::BuildOptions build{tuning.lane_width, Precision::dbl, {}};
  const auto triangle = context.kernel("cholesky.cl", "cholesky_triangle", build);
  const auto rows = context.kernel("cholesky.cl", "cholesky_rows", build);
  constexpr std::size_t kMembers = 64;
  const std::size_t members = std::clamp<std::size_t>(context.largest_group(triangle), 1, kMembers);
  const auto panels = context.allocate_real(kBlock * order, Precision::dbl);
  PanelProducts products(context, tuning, Precision::dbl);
  const auto i32 = [](std::size_t number) { return static_cast<std::int32_t>(number); };
  for (std::size_t first = 0; first < order; first += kBlock) {
    context.launch(triangle, {{members, 1, 1}, {members, 1, 1}}, {i32(order), i32(first), matrix});
    const std::size_t next = first + kBlock;
    if (next == order) break;
    const auto width = static_cast<std::size_t>(tuning.lane_width);
    context.launch(rows, {{(order - next) / width, 1, 1}, {}},
                   {i32(order), i32(first), matrix, panels});
    products(panels, kBlock, order, next, PanelProducts::Update::subtract, matrix);
  }
}

}  // namespace

bool cholesky(Eigen::MatrixXd& matrix) {
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>, Eigen::Lower> in_place(matrix);
  return in_place.info() == Eigen::Success;
}

bool cholesky(const Device& device, Eigen::MatrixXd& matrix) {
  if (!device.info().has_double || matrix.rows() < kLeastOrder) return cholesky(matrix);
  const auto n = static_cast<std::size_t>(matrix.rows());
  const std::size_t order = (n + kBlock - 1) / kBlock * kBlock;
  std::vector<double> values = padded(matrix, order);
  try {
    auto& context = device.context();
    const auto on_device = context.upload_real(values, Precision::dbl);
    factorise(context, device.tuning(Precision::dbl), order, on_device);
    context.read(on_device, values);
  } catch (const DeviceError& error) {
    if (!device::is_out_of_memory(error) && !device::is_refused_group(error)) throw;
    return cholesky(matrix);
  }
  bool is_positive = true;
  for (std::size_t j = 0; j < n; ++j) {
    const double* row = values.data() + j * order;
    std::copy(row + j, row + n, matrix.data() + j * n + j);
    is_positive = is_positive && std::isfinite(row[j]);
  }
  return is_positive;
}

}  // namespace qjulia::fitting
