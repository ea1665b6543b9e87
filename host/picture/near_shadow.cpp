#include "picture/near_shadow.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "picture/depth_grid.hpp"

namespace qjulia::picture {
namespace {

/// Texels are wide if they are wider than kWide pixels. The map shows nothing nearer than kBlind
/// texels.
constexpr double kWide = 2, kBlind = 3;
constexpr double kNarrowest = 2;
constexpr float kAll = 255;

double pixel_of(const View& view) { return view.footprint * view.samples; }

/// Shares smoothed over neighbouring pixels with weights 1, 2, 1 along rows and columns; below 0
/// where a pixel shows nothing. The first and the last row serve their neighbours only and are left
/// out.
std::vector<std::uint8_t> smoothed(const DepthGrid& shares) {
  std::vector<std::uint8_t> smooth(index(0, shares.rows - 2, shares.columns));
  for (int row = 1; row < shares.rows - 1; ++row) {
    for (int column = 0; column < shares.columns; ++column) {
      if (shares.at(column, row) < 0) continue;
      float sum = 0, weights = 0;
      for (int j = row - 1; j <= row + 1; ++j) {
        for (int i = std::max(column - 1, 0); i <= std::min(column + 1, shares.columns - 1); ++i) {
          if (shares.at(i, j) < 0) continue;
          const float weight = (i == column ? 2.0F : 1.0F) * (j == row ? 2.0F : 1.0F);
          sum += weight * shares.at(i, j);
          weights += weight;
        }
      }
      smooth[index(column, row - 1, shares.columns)] =
          static_cast<std::uint8_t>(std::lround(kAll * sum / weights));
    }
  }
  return smooth;
}

}  // namespace

std::vector<std::uint8_t> near_shadow(DepthSource& source, const View& view, const Light& key,
                                      const Strip& strip) {
  const double reach = kBlind * (key.view.footprint - kWide * pixel_of(view));
  if (reach <= 0) return {};
  const int columns = view.columns / strip.samples, half = strip.samples / 2;
  const int sample_rows = static_cast<int>(strip.depths.size()) / view.columns;
  const auto depth_at = [&](int i, int j) {
    return double{strip.depths[index(std::clamp(i, 0, view.columns - 1),
                                     std::clamp(j, 0, sample_rows - 1), view.columns)]};
  };
  const auto point_at = [&](int i, int j) {
    return view.at(i + 0.5, strip.first_row * strip.samples - strip.halo + j + 0.5, depth_at(i, j));
  };
  // With the rows of pixels above and below, so that strips meet without a seam.
  const int rows = strip.rows + 2;
  DepthGrid shares{columns, rows, std::vector<float>(index(0, rows, columns), -1.0F)};
  std::vector<LightRay> rays;
  std::vector<std::size_t> pixels;
  for (int row = 0; row < rows; ++row) {
    const int j = strip.halo + (row - 1) * strip.samples + half;
    if (j < 0 || j >= sample_rows) continue;
    for (int column = 0; column < columns; ++column) {
      const int i = column * strip.samples + half;
      if (depth_at(i, j) < 0) continue;
      // What faces away from the light throws a shadow on itself.
      const bool is_whole = depth_at(i - 1, j) >= 0 && depth_at(i + 1, j) >= 0 &&
                            depth_at(i, j - 1) >= 0 && depth_at(i, j + 1) >= 0;
      const Eigen::Vector3d up_left_normal =
          (point_at(i, j - 1) - point_at(i, j + 1)).cross(point_at(i - 1, j) - point_at(i + 1, j));
      float& share = shares.depths[index(column, row, columns)];
      share = is_whole && up_left_normal.dot(key.towards) <= 0 ? 1 : 0;
      if (share > 0) continue;
      const Eigen::Vector3d from_eye = point_at(i, j) - key.view.eye;
      const double depth = from_eye.dot(key.view.dir);
      rays.push_back({from_eye.dot(key.view.eye_dx) / key.view.eye_dx.squaredNorm(),
                      from_eye.dot(key.view.eye_dy) / key.view.eye_dy.squaredNorm(),
                      static_cast<float>(depth - reach), static_cast<float>(depth)});
      pixels.push_back(index(column, row, columns));
    }
  }
  const std::vector<bool> blocked = source.blocked(key.view, view, rays);
  if (blocked.empty()) return {};
  for (std::size_t i = 0; i < blocked.size(); ++i) shares.depths[pixels[i]] = blocked[i] ? 1 : 0;
  return smoothed(shares);
}

double narrowest_penumbra(const View& view, const Light& key) {
  return std::clamp(key.view.footprint / (kWide * pixel_of(view)), 1.0, kNarrowest);
}

}  // namespace qjulia::picture
