#include "exact/distance_grid.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "qjulia/base/progress.hpp"
#include "qjulia/map/distance_grid.hpp"

namespace qjulia::exact {
namespace {

constexpr int kCoarse = DistanceGridData::kCoarse;
/// The margin on each side of the box, as a share of its longest side. F is then decided at the
/// grid's end, unless the shell is very thick.
constexpr double kMargin = 0.08;
/// Corrections are whole within the first of the surface, and end at the second; cells. The coarse
/// spline alone serves beyond.
constexpr double kWhole = 2, kEnd = 6;

using Cells = std::array<int, 3>;

/// Values at the middles of cells, x fastest, become coefficients of the quadratic spline through
/// them, along one axis. Recursive filter of pole √8 − 3 and gain 8 (Unser, Aldroubi and Eden
/// 1993); beyond the ends values are mirrored.
void filter(std::vector<float>& values, const Cells& cells, std::size_t axis) {
  constexpr float kPole = -0.17157287F, kGain = 8;
  constexpr std::size_t kHorizon = 12;  // the pole's powers are below rounding then
  std::size_t stride = 1;
  for (std::size_t i = 0; i < axis; ++i) stride *= static_cast<std::size_t>(cells[i]);
  const auto along = static_cast<std::size_t>(cells[axis]);
  std::vector<float> start(stride);
  for (std::size_t first = 0; first < values.size(); first += along * stride) {
    float* line = values.data() + first;
    const auto row = [&](std::size_t i) { return line + i * stride; };
    // The value of the recursion before the first row, as if it had come from afar.
    float power = kPole;
    std::ranges::fill(start, 0.0F);
    for (std::size_t i = 0; i < std::min(kHorizon, along); ++i, power *= kPole) {
      for (std::size_t k = 0; k < stride; ++k) start[k] += power * row(i)[k];
    }
    for (std::size_t k = 0; k < stride; ++k) line[k] = kGain * (line[k] + start[k]);
    for (std::size_t i = 1; i < along; ++i) {
      for (std::size_t k = 0; k < stride; ++k) {
        row(i)[k] = kGain * row(i)[k] + kPole * row(i - 1)[k];
      }
    }
    for (std::size_t k = 0; k < stride; ++k) row(along - 1)[k] *= kPole / (kPole - 1);
    for (std::size_t i = along - 1; i-- > 0;) {
      for (std::size_t k = 0; k < stride; ++k) {
        row(i)[k] = kPole * (row(i + 1)[k] - row(i)[k]);
      }
    }
  }
}

std::int16_t rounded(double value, double unit) {
  constexpr double kMost = 32767;
  return static_cast<std::int16_t>(std::lround(std::clamp(value / unit, -kMost, kMost)));
}

/// 1 near the surface, 0 beyond the band, smooth between. @param distance cells.
double weight_at(double distance) {
  const double s = std::clamp((kEnd - std::abs(distance)) / (kEnd - kWhole), 0.0, 1.0);
  return s * s * (3 - 2 * s);
}

/// The middle of a cell of side `side`, in cells of side 1.
Eigen::Vector3d middle_of(std::size_t number, const Cells& cells, int side) {
  Eigen::Vector3d middle;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const auto count = static_cast<std::size_t>(cells[static_cast<std::size_t>(axis)]);
    middle[axis] = side * (static_cast<double>(number % count) + 0.5);
    number /= count;
  }
  return middle;
}

/// Works in cells.
class Sampler {
 public:
  Sampler(Distances distances, const Cells& cells, const std::stop_token& stop)
      : distances_(std::move(distances)), stop_(stop) {
    data_.cells = cells;
  }

  std::shared_ptr<const DistanceGrid> sample() {
    const std::vector<double> middles = sample_coarse();
    const std::vector<float> coarse = DistanceGrid(data_).coefficients();
    correct(near_cells(middles), coarse);
    return std::make_shared<const DistanceGrid>(std::move(data_));
  }

 private:
  std::vector<double> at(const std::vector<Eigen::Vector3d>& points) const {
    throw_if_stopped(stop_);
    return distances_(points);
  }

  /// Distances at the middles of coarse cells.
  std::vector<double> sample_coarse() {
    const Cells cells = data_.coarse_cells();
    std::vector<Eigen::Vector3d> points;
    for (std::size_t i = 0; i < data_.coarse_size(); ++i) {
      points.push_back(middle_of(i, cells, kCoarse));
    }
    std::vector<double> found = at(points);
    std::vector<float> values(found.begin(), found.end());
    for (std::size_t axis = 0; axis < 3; ++axis) filter(values, cells, axis);
    data_.coarse.clear();
    for (const float value : values) {
      data_.coarse.push_back(rounded(value, DistanceGridData::kCoarseUnit));
    }
    return found;
  }

  /// Numbers of cells that may lie in the band: distance changes by no more than the way.
  std::vector<std::size_t> near_cells(const std::vector<double>& middles) const {
    const Cells coarse = data_.coarse_cells();
    const Cells& cells = data_.cells;
    std::vector<std::size_t> near;
    for (std::size_t i = 0; i < middles.size(); ++i) {
      const double reach = 0.5 * (kCoarse - 1) * std::sqrt(3.0);
      if (std::abs(middles[i]) >= kEnd + reach) continue;
      const Eigen::Vector3d middle = middle_of(i, coarse, kCoarse);
      for (int z = 0; z < kCoarse; ++z) {
        for (int y = 0; y < kCoarse; ++y) {
          for (int x = 0; x < kCoarse; ++x) {
            const Eigen::Vector3d corner = middle.array() - 0.5 * kCoarse;
            const Eigen::Vector3d cell = corner + Eigen::Vector3d(x, y, z);
            const double way = (cell.array() + 0.5 - middle.array()).matrix().norm();
            if (std::abs(middles[i]) >= kEnd + way) continue;
            near.push_back(
                (static_cast<std::size_t>(cell.z()) * static_cast<std::size_t>(cells[1]) +
                 static_cast<std::size_t>(cell.y())) *
                    static_cast<std::size_t>(cells[0]) +
                static_cast<std::size_t>(cell.x()));
          }
        }
      }
    }
    return near;
  }

  /// The spline of these coefficients at the middle of a cell. Beyond the grid's ends the last ones
  /// are repeated.
  double spline_at(const std::vector<float>& coefficients, std::size_t number) const {
    constexpr std::array<double, 3> kWeights{0.125, 0.75, 0.125};
    // Where the three coefficients about the cell stand along each axis.
    std::array<std::array<std::size_t, 3>, 3> at{};
    std::size_t stride = 1, rest = number;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto count = static_cast<std::size_t>(data_.cells[axis]);
      const std::size_t cell = rest % count;
      at[axis] = {stride * (cell - std::min<std::size_t>(cell, 1)), stride * cell,
                  stride * std::min(cell + 1, count - 1)};
      stride *= count;
      rest /= count;
    }
    double sum = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      for (std::size_t j = 0; j < 3; ++j) {
        const float* row = coefficients.data() + at[2][k] + at[1][j];
        const double along =
            0.75 * static_cast<double>(row[at[0][1]]) +
            0.125 * (static_cast<double>(row[at[0][0]]) + static_cast<double>(row[at[0][2]]));
        sum += kWeights[k] * kWeights[j] * along;
      }
    }
    return sum;
  }

  /// What the coarse spline misses at these cells' middles becomes a spline of its own.
  void correct(const std::vector<std::size_t>& near, const std::vector<float>& coarse) {
    std::vector<Eigen::Vector3d> points;
    points.reserve(near.size());
    for (const std::size_t number : near) points.push_back(middle_of(number, data_.cells, 1));
    const std::vector<double> found = at(points);
    std::vector<float> missed(data_.size());
    for (std::size_t i = 0; i < near.size(); ++i) {
      if (i % 65536 == 0) throw_if_stopped(stop_);
      const double weight = weight_at(found[i]);
      if (weight == 0) continue;
      missed[near[i]] = static_cast<float>(weight * (found[i] - spline_at(coarse, near[i])));
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
      throw_if_stopped(stop_);
      filter(missed, data_.cells, axis);
    }
    throw_if_stopped(stop_);
    keep_blocks(missed);
  }

  /// Coarse cells in which a coefficient does not round to 0; but the outermost, where the spline
  /// is not evaluated.
  void keep_blocks(const std::vector<float>& coefficients) {
    const Cells cells = data_.coarse_cells();
    const auto x = static_cast<std::size_t>(data_.cells[0]);
    const std::size_t layer = x * static_cast<std::size_t>(data_.cells[1]);
    std::array<std::int16_t, DistanceGridData::kBlock> block{};
    std::uint32_t number = 0;
    const auto is_end = [](int at, int count) { return at == 0 || at + 1 == count; };
    for (int z = 0; z < cells[2]; ++z) {
      for (int y = 0; y < cells[1]; ++y) {
        for (int cx = 0; cx < cells[0]; ++cx, ++number) {
          if (is_end(cx, cells[0]) || is_end(y, cells[1]) || is_end(z, cells[2])) continue;
          const float* corner =
              coefficients.data() + static_cast<std::size_t>(kCoarse * z) * layer +
              static_cast<std::size_t>(kCoarse * y) * x + static_cast<std::size_t>(kCoarse * cx);
          bool any = false;
          for (std::size_t i = 0; i < block.size(); ++i) {
            const float c = corner[i / 16 * layer + i / 4 % 4 * x + i % 4];
            block[i] = rounded(static_cast<double>(c), DistanceGridData::kCorrectionUnit);
            any = any || block[i] != 0;
          }
          if (!any) continue;
          data_.blocks.push_back(number);
          data_.corrections.insert(data_.corrections.end(), block.begin(), block.end());
        }
      }
    }
  }

  Distances distances_;
  std::stop_token stop_;
  DistanceGridData data_;
};

}  // namespace

DistanceModulus sampled_distance(const Distances& distances, const Box& box, int resolution,
                                 const std::stop_token& stop) {
  const double longest = box.size().maxCoeff();
  // One coarse cell at each end is there for its coefficients.
  const double step = (1 + 2 * kMargin) * longest / (resolution - 2 * kCoarse);
  DistanceModulus sampled;
  sampled.step = step;
  Cells cells{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double side = box.size()[static_cast<Eigen::Index>(axis)] + 2 * kMargin * longest;
    const int coarse = static_cast<int>(std::ceil(side / (kCoarse * step) - 1e-6)) + 2;
    cells[axis] = kCoarse * std::max(coarse, DistanceGrid::kFewestCells / kCoarse);
  }
  sampled.origin = box.center() - 0.5 * step * Eigen::Vector3d(cells[0], cells[1], cells[2]);
  const auto in_cells = [&](std::span<const Eigen::Vector3d> points) {
    std::vector<Eigen::Vector3d> moved(points.size());
    std::ranges::transform(points, moved.begin(), [&](const Eigen::Vector3d& x) {
      return Eigen::Vector3d(sampled.origin + step * x);
    });
    std::vector<double> found = distances(moved);
    for (double& d : found) d /= step;
    return found;
  };
  sampled.grid = Sampler(in_cells, cells, stop).sample();
  return sampled;
}

}  // namespace qjulia::exact
