#include "qjulia/map/slope.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/random.hpp"
#include "base/range_check.hpp"

namespace qjulia {

std::optional<double> steepest_slope(const Field& field, double slice, double level,
                                     const Box& box) {
  base::expect_finite("slice", slice);
  base::expect_finite("level", level);
  base::Random random(1);
  std::vector<Quaternion> points(4096);
  for (Quaternion& q : points) {
    q = {std::lerp(box.low.x(), box.high.x(), random.uniform()),
         std::lerp(box.low.y(), box.high.y(), random.uniform()),
         std::lerp(box.low.z(), box.high.z(), random.uniform()), slice};
  }
  std::vector<double> slopes;
  for (int step = 0; step < 5; ++step) {
    const auto values = field.at(points, 1);
    const auto gradients = field.gradient_at(points);
    slopes.clear();
    for (std::size_t i = 0; i < points.size(); ++i) {
      Quaternion g = gradients[i];
      g.w = 0;
      const double above = values[i] - level, slope = norm(g);
      if (std::abs(above) < 0.5 && std::isfinite(slope)) slopes.push_back(slope);
      if (slope > 0) points[i] = points[i] - (std::clamp(above / slope, -0.5, 0.5) / slope) * g;
    }
  }
  if (slopes.empty()) return std::nullopt;
  const auto at =
      slopes.begin() + static_cast<std::ptrdiff_t>(0.95 * static_cast<double>(slopes.size()));
  std::ranges::nth_element(slopes, at);
  return *at;
}

}  // namespace qjulia
