#include "qjulia/map/paint.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "map/checks.hpp"

namespace qjulia {
namespace {

/// Weights of the coefficients before, at and after a point's cell. The point lies t cells after
/// the cell's middle.
std::array<double, 3> spline_weights(double t) {
  return {0.5 * (0.5 - t) * (0.5 - t), 0.75 - t * t, 0.5 * (0.5 + t) * (0.5 + t)};
}

[[noreturn]] void refuse_paint(const std::string& what) {
  throw InputError("the map's paint." + what);
}

}  // namespace

std::size_t Paint::size() const {
  return Eigen::Array3i(cells.data()).max(0).cast<std::size_t>().prod();
}

double Paint::at(const Eigen::Vector3d& x) const {
  validate();
  if (!x.allFinite()) throw InputError("the paint has no share for a place that is not finite");
  std::array<std::size_t, 3> first{};
  std::array<std::array<double, 3>, 3> weights{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto row = static_cast<Eigen::Index>(axis);
    const double u = std::clamp((x[row] - origin[row]) / step, kMargin, cells[axis] - kMargin);
    first[axis] = static_cast<std::size_t>(u) - 1;
    weights[axis] = spline_weights(u - std::floor(u) - 0.5);
  }
  double sum = 0;
  for (std::size_t i = 0; i < 27; ++i) {
    const std::size_t a = i % 3, b = i / 3 % 3, c = i / 9;
    const std::size_t number =
        ((first[2] + c) * static_cast<std::size_t>(cells[1]) + first[1] + b) *
            static_cast<std::size_t>(cells[0]) +
        first[0] + a;
    sum += weights[0][a] * weights[1][b] * weights[2][c] * (shares[number] + 1);
  }
  return sum / (kWhole + 1);
}

Eigen::Vector3d Paint::center(int i, int j, int k) const {
  return origin + step * Eigen::Vector3d(i + 0.5, j + 0.5, k + 0.5);
}

void Paint::validate() const {
  for (const int along : cells) {
    if (along >= kFewestCells && along <= kMostCells) continue;
    refuse_paint(
        fmt::format("cells has {}: each must be {} to {}", along, kFewestCells, kMostCells));
  }
  if (size() > kMostInAll) {
    refuse_paint(fmt::format("cells make {} in all: at most {} are allowed", size(), kMostInAll));
  }
  if (shares.size() != size()) {
    refuse_paint(fmt::format("data has {} shares, and its cells need {}", shares.size(), size()));
  }
  map::check_length("paint.step", step);
  map::check_origin("paint.origin", origin);
}

std::uint8_t painted_share(double share) {
  if (std::isnan(share)) throw InputError("a share of the detail is not a number");
  const double rounded = std::round((Paint::kWhole + 1) * share) - 1;
  return static_cast<std::uint8_t>(std::clamp<double>(rounded, 0, Paint::kWhole));
}

}  // namespace qjulia
