#include "qjulia/map/distance_grid.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "qjulia/base/error.hpp"

namespace qjulia {
namespace {

using Cells = std::array<int, 3>;
using Strides = std::array<std::size_t, 3>;

std::size_t count_of(const Cells& cells) {
  return static_cast<std::size_t>(cells[0]) * static_cast<std::size_t>(cells[1]) *
         static_cast<std::size_t>(cells[2]);
}

Strides strides_of(const Cells& cells) {
  const auto x = static_cast<std::size_t>(cells[0]);
  return {1, x, x * static_cast<std::size_t>(cells[1])};
}

std::size_t offset_of(const Cells& cell, const Strides& strides) {
  return static_cast<std::size_t>(cell[0]) + static_cast<std::size_t>(cell[1]) * strides[1] +
         static_cast<std::size_t>(cell[2]) * strides[2];
}

/// The coefficients of the same spline on cells half as long along one axis (Chaikin 1974). At the
/// ends, which no point is near enough to see, the last ones are repeated.
std::vector<float> halved(const std::vector<float>& from, Cells& cells, std::size_t axis) {
  const auto along = static_cast<std::size_t>(cells[axis]);
  const std::size_t stride = strides_of(cells)[axis];
  const std::size_t outer = from.size() / (along * stride);
  std::vector<float> to(2 * from.size());
  for (std::size_t o = 0; o < outer; ++o) {
    for (std::size_t i = 0; i < along; ++i) {
      const float* here = from.data() + (o * along + i) * stride;
      const float* before = i > 0 ? here - stride : here;
      const float* after = i + 1 < along ? here + stride : here;
      float* first = to.data() + 2 * (o * along + i) * stride;
      for (std::size_t k = 0; k < stride; ++k) {
        first[k] = 0.25F * before[k] + 0.75F * here[k];
        first[stride + k] = 0.75F * here[k] + 0.25F * after[k];
      }
    }
  }
  cells[axis] *= 2;
  return to;
}

/// A bound of the gradient in one cell of a spline: it is a mean of 27 vectors, its control points
/// as a Bézier polynomial of degree 2 along each axis. @param at the middle coefficient of 27.
double close_slope_in_cell(const float* at, const Strides& strides) {
  using Weights = std::array<std::array<double, 3>, 3>;  // a coefficient's, for each control point
  constexpr Weights kValue{{{0.5, 0.5, 0}, {0, 1, 0}, {0, 0.5, 0.5}}};
  constexpr Weights kSlope{{{-1, 1, 0}, {-0.5, 0, 0.5}, {0, -1, 1}}};
  const float* const first = at - strides[0] - strides[1] - strides[2];
  double most = 0;
  for (std::size_t point = 0; point < 27; ++point) {
    const std::array<std::size_t, 3> control{point % 3, point / 3 % 3, point / 9};
    double square = 0;
    for (std::size_t along = 0; along < 3; ++along) {
      double sum = 0;
      for (std::size_t i = 0; i < 27; ++i) {
        const std::array<std::size_t, 3> cell{i % 3, i / 3 % 3, i / 9};
        double weight = 1;
        for (std::size_t axis = 0; axis < 3; ++axis) {
          weight *= (axis == along ? kSlope : kValue)[control[axis]][cell[axis]];
        }
        if (weight == 0) continue;
        const std::size_t offset = cell[0] + cell[1] * strides[1] + cell[2] * strides[2];
        sum += weight * static_cast<double>(first[offset]);
      }
      square += sum * sum;
    }
    most = std::max(most, square);
  }
  return std::sqrt(most);
}

/// The same, not as close: along each axis the gradient is a mean of differences of neighbouring
/// coefficients.
double slope_in_cell(const float* at, const Strides& strides) {
  double square = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto along = static_cast<std::ptrdiff_t>(strides[axis]);
    const auto a = static_cast<std::ptrdiff_t>(strides[(axis + 1) % 3]);
    const auto b = static_cast<std::ptrdiff_t>(strides[(axis + 2) % 3]);
    float most = 0;
    for (std::ptrdiff_t i = -1; i <= 1; ++i) {
      for (std::ptrdiff_t j = -1; j <= 1; ++j) {
        const float* row = at + i * a + j * b;
        most = std::max({most, std::abs(row[along] - *row), std::abs(*row - row[-along])});
      }
    }
    square += static_cast<double>(most) * static_cast<double>(most);
  }
  return std::sqrt(square);
}

[[noreturn]] void refuse(const std::string& what) {
  throw InputError("the map's distance." + what);
}

void check(const DistanceGridData& data) {
  for (const int cells : data.cells) {
    if (cells < DistanceGrid::kFewestCells || cells > DistanceGrid::kMostCells ||
        cells % DistanceGridData::kCoarse != 0) {
      refuse(fmt::format("cells has {}: each must be a multiple of 4 from {} to {}", cells,
                         DistanceGrid::kFewestCells, DistanceGrid::kMostCells));
    }
  }
  if (data.size() > DistanceGrid::kMostInAll) {
    refuse(fmt::format("cells make {} in all: at most {} are allowed", data.size(),
                       DistanceGrid::kMostInAll));
  }
  if (data.coarse.size() != data.coarse_size()) {
    refuse(fmt::format("coarse has {} numbers, and {} cells need {}", data.coarse.size(),
                       data.size(), data.coarse_size()));
  }
  if (data.corrections.size() != DistanceGridData::kBlock * data.blocks.size()) {
    refuse(fmt::format("corrections has {} numbers, and {} blocks need {}", data.corrections.size(),
                       data.blocks.size(), DistanceGridData::kBlock * data.blocks.size()));
  }
  const Cells coarse = data.coarse_cells();
  const auto is_outermost = [&](std::size_t number) {
    for (const int count : coarse) {
      const std::size_t at = number % static_cast<std::size_t>(count);
      if (at == 0 || at + 1 == static_cast<std::size_t>(count)) return true;
      number /= static_cast<std::size_t>(count);
    }
    return false;
  };
  for (std::size_t i = 0; i < data.blocks.size(); ++i) {
    if (data.blocks[i] >= data.coarse.size() || (i > 0 && data.blocks[i] <= data.blocks[i - 1])) {
      refuse("blocks must be numbers of coarse cells that rise");
    }
    if (is_outermost(data.blocks[i])) {
      refuse("blocks names an outermost coarse cell; only inner ones have corrections");
    }
  }
  for (std::size_t i = 0; i < data.coarse.size(); ++i) {
    if (data.coarse[i] > 0 || !is_outermost(i)) continue;
    refuse("coarse puts an outermost cell inside; every outermost cell must lie outside");
  }
}

/// Raises `slope` to a bound that also holds in a block of `counts` cells, each `cell` wide.
void include_cells(const float* first, const Cells& counts, const Strides& strides, double cell,
                   double& slope) {
  for (int z = 0; z < counts[2]; ++z) {
    for (int y = 0; y < counts[1]; ++y) {
      for (int x = 0; x < counts[0]; ++x) {
        const float* at = first + offset_of({x, y, z}, strides);
        if (slope_in_cell(at, strides) <= slope * cell) continue;
        slope = std::max(slope, close_slope_in_cell(at, strides) / cell);
      }
    }
  }
}

}  // namespace

std::size_t DistanceGridData::size() const { return count_of(cells); }
std::size_t DistanceGridData::coarse_size() const { return count_of(coarse_cells()); }

DistanceGrid::DistanceGrid(DistanceGridData data) : data_(std::move(data)) { check(data_); }

const std::vector<float>& DistanceGrid::coefficients() const {
  std::call_once(once_, [this] { expand(); });
  return coefficients_;
}

double DistanceGrid::slope() const {
  coefficients();
  return slope_;
}

void DistanceGrid::expand() const {
  constexpr std::size_t kCoarse = DistanceGridData::kCoarse;
  Cells cells = data_.coarse_cells();
  const Strides coarse = strides_of(cells);
  coefficients_.resize(data_.coarse.size());
  std::ranges::transform(data_.coarse, coefficients_.begin(), [](std::int16_t c) {
    return static_cast<float>(c * DistanceGridData::kCoarseUnit);
  });
  // Coarse cells about each, and in those with corrections cells about each, bound the slope.
  include_cells(coefficients_.data() + offset_of({1, 1, 1}, coarse),
                {cells[0] - 2, cells[1] - 2, cells[2] - 2}, coarse, kCoarse, slope_);
  for (int halving = 0; halving < 2; ++halving) {
    for (std::size_t axis = 0; axis < 3; ++axis) coefficients_ = halved(coefficients_, cells, axis);
  }
  const Strides strides = strides_of(cells);
  std::vector<std::size_t> corners;  // the first cell of each block
  for (std::size_t i = 0; i < data_.blocks.size(); ++i) {
    const std::size_t number = data_.blocks[i];
    const std::size_t corner =
        kCoarse * (number / coarse[2] * strides[2] + number % coarse[2] / coarse[1] * strides[1] +
                   number % coarse[1]);
    corners.push_back(corner);
    const std::int16_t* correction = data_.corrections.data() + DistanceGridData::kBlock * i;
    for (std::size_t z = 0; z < kCoarse; ++z) {
      for (std::size_t y = 0; y < kCoarse; ++y) {
        float* row = coefficients_.data() + corner + z * strides[2] + y * strides[1];
        for (std::size_t x = 0; x < kCoarse; ++x) {
          row[x] += static_cast<float>(*correction++ * DistanceGridData::kCorrectionUnit);
        }
      }
    }
  }
  // A cell beside a block takes coefficients of it too.
  for (const std::size_t corner : corners) {
    constexpr int kTouched = DistanceGridData::kCoarse + 2;
    include_cells(coefficients_.data() + corner - offset_of({1, 1, 1}, strides),
                  {kTouched, kTouched, kTouched}, strides, 1, slope_);
  }
}

double DistanceGrid::farthest_inside(const std::array<double, 3>& center) const {
  const std::vector<float>& all = coefficients();
  const auto [nx, ny, nz] = data_.cells;
  double farthest = 0;
  std::size_t number = 0;
  // The spline at a point is a mean of the 27 coefficients about its cell.
  for (int z = 0; z < nz; ++z) {
    for (int y = 0; y < ny; ++y) {
      for (int x = 0; x < nx; ++x, ++number) {
        if (all[number] > 0) continue;
        const std::array<int, 3> cell{x, y, z};
        double square = 0;
        for (std::size_t i = 0; i < 3; ++i) {
          const double away = std::abs(cell[i] + 0.5 - center[i]) + 1.5;
          square += away * away;
        }
        farthest = std::max(farthest, square);
      }
    }
  }
  return std::sqrt(farthest);
}

}  // namespace qjulia
