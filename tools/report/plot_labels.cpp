#include "report/plot_labels.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace qjulia::report {

bool PlotLabels::is_free(const LabelBox& box) const {
  constexpr double kRoom = 2;
  const auto within = [&](const Place& p) {
    return p.x > box.left - kRoom && p.x < box.right() + kRoom && p.y > box.top - kRoom &&
           p.y < box.bottom() + kRoom;
  };
  const auto overlaps = [&](const LabelBox& other) {
    return other.left < box.right() + kRoom && box.left < other.right() + kRoom &&
           other.top < box.bottom() + kRoom && box.top < other.bottom() + kRoom;
  };
  return box.left >= frame_.left && box.right() <= frame_.right() && box.top >= frame_.top &&
         box.bottom() <= frame_.bottom() && std::ranges::none_of(clear_, within) &&
         std::ranges::none_of(placed_, overlaps);
}

void PlotLabels::keep_clear(double x0, double y0, double x1, double y1) {
  constexpr double kStep = 3;
  const double length = std::hypot(x1 - x0, y1 - y0);
  for (double s = 0; s < length; s += kStep) {
    keep_clear(x0 + s / length * (x1 - x0), y0 + s / length * (y1 - y0));
  }
}

LabelBox PlotLabels::place(double x, double y, double width, double height) {
  /// Which way from the point, beside it first: right, left, below, above, and between these.
  constexpr std::array<std::array<double, 2>, 8> kWays{
      {{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {-1, 1}, {1, -1}, {-1, -1}}};
  constexpr std::array<double, 6> kDistances{8, 18, 32, 50, 72, 100};
  const auto at = [&](double distance, const std::array<double, 2>& way) {
    return LabelBox{x + distance * way[0] + 0.5 * (way[0] - 1) * width,
                    y + distance * way[1] + 0.5 * (way[1] - 1) * height, width, height};
  };
  LabelBox found = at(kDistances[0], kWays[0]);
  for (const double distance : kDistances) {
    const auto free =
        std::ranges::find_if(kWays, [&](const auto& way) { return is_free(at(distance, way)); });
    if (free == kWays.end()) continue;
    found = at(distance, *free);
    break;
  }
  placed_.push_back(found);
  return found;
}

}  // namespace qjulia::report
