#include "surface/box_dimension.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace qjulia {
namespace {

constexpr int kCoarsest = 3;  // 2³ boxes along the longest side
constexpr int kFinest = 9;

/// Boxes of a cube, 2^`level` along each side, and which of them hold a point.
class Boxes {
 public:
  explicit Boxes(int level) : level_(level), held_(std::size_t{1} << 3 * level) {}

  void hold(std::uint32_t x, std::uint32_t y, std::uint32_t z) {
    held_[(std::size_t{z} << 2 * level_) + (std::size_t{y} << level_) + x] = true;
  }
  std::size_t count() const {
    return static_cast<std::size_t>(std::count(held_.begin(), held_.end(), true));
  }
  /// Boxes twice as wide.
  Boxes coarser() const {
    Boxes wide(level_ - 1);
    const std::uint32_t mask = (1U << level_) - 1;
    for (std::size_t i = 0; i < held_.size(); ++i) {
      if (!held_[i]) continue;
      wide.hold((static_cast<std::uint32_t>(i) & mask) / 2,
                (static_cast<std::uint32_t>(i >> level_) & mask) / 2,
                static_cast<std::uint32_t>(i >> 2 * level_) / 2);
    }
    return wide;
  }

 private:
  int level_;
  std::vector<bool> held_;
};

}  // namespace

BoxDimension box_dimension(std::span<const Eigen::Vector3f> points, double finest) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  if (points.empty()) return {kNone, kNone, 0};
  Eigen::Vector3f low = points.front();
  Eigen::Vector3f high = low;
  for (const Eigen::Vector3f& p : points) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const float side = (high - low).maxCoeff();
  int level = kFinest;
  while (level >= kCoarsest && static_cast<double>(side) / (1 << level) < finest) --level;
  const int sizes = level - kCoarsest + 1;
  if (sizes < 3) return {kNone, kNone, std::max(0, sizes)};

  Boxes boxes(level);
  const auto most = static_cast<float>((1 << level) - 1);
  const float scale = static_cast<float>(1 << level) / side;
  for (const Eigen::Vector3f& p : points) {
    const Eigen::Vector3f at = (scale * (p - low)).cwiseMin(most);
    boxes.hold(static_cast<std::uint32_t>(at.x()), static_cast<std::uint32_t>(at.y()),
               static_cast<std::uint32_t>(at.z()));
  }
  // Least squares for ln N over ln 1/s, in units of ln 2.
  std::vector<double> counts;
  for (; level >= kCoarsest; --level) {
    counts.push_back(std::log2(static_cast<double>(boxes.count())));
    if (level > kCoarsest) boxes = boxes.coarser();
  }
  double mean = 0;
  for (const double c : counts) mean += c / sizes;
  double slope = 0;
  double spread = 0;
  const auto abscissa = [&](int i) { return 0.5 * (sizes - 1) - i; };
  for (int i = 0; i < sizes; ++i) {
    slope += abscissa(i) * counts[static_cast<std::size_t>(i)];
    spread += abscissa(i) * abscissa(i);
  }
  slope /= spread;
  double residual = 0;
  for (int i = 0; i < sizes; ++i) {
    const double r = counts[static_cast<std::size_t>(i)] - mean - slope * abscissa(i);
    residual += r * r;
  }
  return {slope, std::sqrt(residual / (sizes - 2) / spread), sizes};
}

}  // namespace qjulia
