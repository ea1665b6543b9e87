#include "picture/bounce.hpp"

#include <algorithm>
#include <cmath>

#include "layout/picture_layout.h"
#include "picture/depth_grid.hpp"

namespace qjulia::picture {
namespace {

constexpr std::size_t kTexel = QJ_BOUNCE_SIZE;

/// Rows of a square of texels, at half the fineness: numbers are the means of those that count.
/// @param counts whether a texel counts. @param size numbers of a texel.
template <class Counts, class Put>
void for_halves(int side, const Counts& counts, const Put& put) {
  const int half = (side + 1) / 2;
  for (int row = 0; row < half; ++row) {
    for (int column = 0; column < half; ++column) {
      std::vector<std::size_t> found;
      for (int j = 2 * row; j < std::min(2 * row + 2, side); ++j) {
        for (int i = 2 * column; i < std::min(2 * column + 2, side); ++i) {
          const std::size_t texel = index(i, j, side);
          if (counts(texel)) found.push_back(texel);
        }
      }
      put(found);
    }
  }
}

}  // namespace

LitSurface lit_surface(const Light& lamp, const std::vector<float>& normals) {
  LitSurface made;
  const View& fine = lamp.view;
  made.view = fine;
  made.view.columns = made.view.rows = (fine.columns + 1) / 2;
  made.view.eye_dx *= 2;
  made.view.eye_dy *= 2;
  made.view.footprint *= 2;
  for_halves(
      fine.columns, [&](std::size_t i) { return lamp.depths[i] >= 0; },
      [&](const std::vector<std::size_t>& texels) {
        float depth = 0;
        Eigen::Vector3f normal = Eigen::Vector3f::Zero();
        for (const std::size_t i : texels) {
          depth += lamp.depths[i];
          normal += Eigen::Map<const Eigen::Vector3f>(normals.data() + 3 * i);
        }
        const auto count = static_cast<float>(texels.size());
        made.depths.push_back(texels.empty() ? float{QJ_NO_HIT} : depth / count);
        // Of the four, so that the texel's light is that of what it shows of the shape.
        normal *= 0.25F;
        made.normals.insert(made.normals.end(), normal.data(), normal.data() + 3);
      });
  return made;
}

std::vector<float> bounce_levels(const LitSurface& surface, const std::vector<Rgb>& albedo) {
  std::vector<float> level;
  for (std::size_t i = 0; i < surface.depths.size(); ++i) {
    level.push_back(surface.depths[i]);
    level.insert(level.end(), surface.normals.begin() + static_cast<std::ptrdiff_t>(3 * i),
                 surface.normals.begin() + static_cast<std::ptrdiff_t>(3 * i + 3));
    for (const double c : albedo[i]) level.push_back(static_cast<float>(c));
  }
  std::vector<float> all = level;
  for (int side = surface.view.columns; side > QJ_BOUNCE_LAST; side = (side + 1) / 2) {
    std::vector<float> next;
    for_halves(
        side, [&](std::size_t i) { return level[kTexel * i] >= 0; },
        [&](const std::vector<std::size_t>& texels) {
          Eigen::Matrix<float, QJ_BOUNCE_SIZE, 1> sum;
          sum.setZero();
          for (const std::size_t i : texels) {
            sum += Eigen::Map<const Eigen::Matrix<float, QJ_BOUNCE_SIZE, 1>>(level.data() +
                                                                             kTexel * i);
          }
          const auto count = static_cast<float>(std::max<std::size_t>(texels.size(), 1));
          sum[QJ_BOUNCE_DEPTH] = texels.empty() ? float{QJ_NO_HIT} : sum[QJ_BOUNCE_DEPTH] / count;
          sum.segment<3>(QJ_BOUNCE_NORMAL) *= 0.25F;
          sum.segment<3>(QJ_BOUNCE_ALBEDO) /= count;
          next.insert(next.end(), sum.data(), sum.data() + QJ_BOUNCE_SIZE);
        });
    level = std::move(next);
    all.insert(all.end(), level.begin(), level.end());
  }
  return all;
}

}  // namespace qjulia::picture
