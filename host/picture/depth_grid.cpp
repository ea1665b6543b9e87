#include "picture/depth_grid.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace qjulia::picture {
namespace {

/// How far, in pixels, depth may bend over three pixels of a smooth place.
constexpr double kSmoothBend = 1.0;

}  // namespace

PixelKind DepthGrid::kind(int column, int row, double pixel) const {
  int hits = 0;
  for (int j = std::max(row - 1, 0); j <= std::min(row + 1, rows - 1); ++j) {
    for (int i = std::max(column - 1, 0); i <= std::min(column + 1, columns - 1); ++i) {
      if (at(i, j) >= 0) ++hits;
    }
  }
  if (hits == 0) return PixelKind::empty;
  if (hits < 9) return PixelKind::rough;
  const auto bend = [&](int di, int dj) {
    return std::abs(at(column - di, row - dj) + at(column + di, row + dj) - 2 * at(column, row));
  };
  const float most = std::max({bend(1, 0), bend(0, 1), bend(1, 1), bend(1, -1)});
  return most < kSmoothBend * pixel ? PixelKind::smooth : PixelKind::rough;
}

float DepthGrid::nearest(double x, double y) const {
  const int i = static_cast<int>(std::floor(x)), j = static_cast<int>(std::floor(y));
  // The four pixel centres about the place, or where one of them is empty, those around as well.
  for (const int wider : {0, 1}) {
    float least = std::numeric_limits<float>::max();
    bool has_empty = false;
    for (int row = std::max(j - wider, 0); row <= std::min(j + 1 + wider, rows - 1); ++row) {
      for (int column = std::max(i - wider, 0); column <= std::min(i + 1 + wider, columns - 1);
           ++column) {
        const float depth = at(column, row);
        has_empty = has_empty || depth < 0;
        if (depth >= 0) least = std::min(least, depth);
      }
    }
    if (!has_empty || wider == 1) return least;
  }
  return 0;
}

float DepthGrid::interpolated(double x, double y) const {
  const int i = std::clamp(static_cast<int>(std::floor(x)), 0, columns - 2);
  const int j = std::clamp(static_cast<int>(std::floor(y)), 0, rows - 2);
  const double u = x - i, v = y - j;
  const double above = std::lerp(double{at(i, j)}, double{at(i + 1, j)}, u);
  const double below = std::lerp(double{at(i, j + 1)}, double{at(i + 1, j + 1)}, u);
  return static_cast<float>(std::lerp(above, below, v));
}

}  // namespace qjulia::picture
