#include "measure/outline.hpp"

#include <cmath>
#include <limits>

namespace qjulia::surface {
namespace {

constexpr double kNowhere = std::numeric_limits<double>::infinity();

/// One line of a grid at a time: min over j of (i − j)² + f(j) for all i, by the lower envelope of
/// these parabolas (Felzenszwalb and Huttenlocher 2012).
class ParabolaEnvelope {
 public:
  explicit ParabolaEnvelope(std::size_t most) : at_(most), from_(most + 1), values_(most) {}

  /// Replaces the `count` values that lie `stride` apart from `first` on.
  void transform(double* first, std::size_t count, std::size_t stride) {
    std::size_t kept = 0;
    for (std::size_t j = 0; j < count; ++j) {
      values_[j] = first[j * stride];
      if (values_[j] == kNowhere) continue;
      double crossing = -kNowhere;
      while (kept > 0 && (crossing = crossing_of(at_[kept - 1], j)) <= from_[kept - 1]) --kept;
      from_[kept] = kept == 0 ? -kNowhere : crossing;
      at_[kept++] = j;
    }
    if (kept == 0) return;
    from_[kept] = kNowhere;
    std::size_t lowest = 0;
    for (std::size_t i = 0; i < count; ++i) {
      while (from_[lowest + 1] < static_cast<double>(i)) ++lowest;
      const double way = static_cast<double>(i) - static_cast<double>(at_[lowest]);
      first[i * stride] = way * way + values_[at_[lowest]];
    }
  }

 private:
  /// Where the parabola of j gets below that of i < j.
  double crossing_of(std::size_t i, std::size_t j) const {
    const auto a = static_cast<double>(i), b = static_cast<double>(j);
    return ((values_[j] + b * b) - (values_[i] + a * a)) / (2 * (b - a));
  }

  std::vector<std::size_t> at_;  ///< whose parabolas are lowest, from left to right
  std::vector<double> from_;     ///< where each begins to be
  std::vector<double> values_;   ///< the line as it was
};

}  // namespace

std::vector<double> power_of_balls(const Grid& grid, const std::vector<double>& radius) {
  std::vector<double> power(radius.size(), kNowhere);  // in squared steps
  for (std::size_t i = 0; i < radius.size(); ++i) {
    if (radius[i] > 0) power[i] = -(radius[i] / grid.step) * (radius[i] / grid.step);
  }
  const auto points = grid.points.cast<std::size_t>().eval();
  ParabolaEnvelope envelope(points.maxCoeff());
  std::size_t stride = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const std::size_t count = points[axis];
    for (std::size_t first = 0; first < power.size(); ++first) {
      if (first / stride % count == 0) envelope.transform(&power[first], count, stride);
    }
    stride *= count;
  }
  for (double& value : power) value *= grid.step * grid.step;
  return power;
}

}  // namespace qjulia::surface
