#include "picture/reflectance.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "layout/picture_layout.h"

namespace qjulia::picture {
namespace {

struct Share {
  double a = 0, b = 0;
};

/// The mean over half-vectors that are drawn in proportion to the distribution of normals.
Share share_of(double cosine, double roughness) {
  constexpr int kPolar = 48, kTurns = 16;
  constexpr double kLeastWidth = 0.012;  // that of matter.clh
  const double width = std::max(roughness * roughness, kLeastWidth), a2 = width * width;
  const double sine = std::sqrt(1 - cosine * cosine);
  Share share;
  for (int i = 0; i < kPolar; ++i) {
    const double u = (i + 0.5) / kPolar;
    const double nh = std::sqrt((1 - u) / (1 + (a2 - 1) * u));
    const double away = std::sqrt(1 - nh * nh);
    for (int j = 0; j < kTurns; ++j) {
      // Rows are turned against one another; one half of the circle mirrors the other.
      const double turn = (j + std::fmod(0.618034 * i, 1.0)) * std::numbers::pi / kTurns;
      const double vh = sine * away * std::cos(turn) + cosine * nh;
      const double nl = 2 * vh * nh - cosine;
      if (nl <= 0 || vh <= 0) continue;
      const double shadowing = nl * std::sqrt(cosine * cosine * (1 - a2) + a2) +
                               cosine * std::sqrt(nl * nl * (1 - a2) + a2);
      const double weight = 2 * nl * vh / (shadowing * nh);
      const double edge = std::pow(1 - vh, 5);
      share.a += (1 - edge) * weight;
      share.b += edge * weight;
    }
  }
  constexpr double kCount = kPolar * kTurns;
  return {share.a / kCount, share.b / kCount};
}

std::vector<float> made_table() {
  constexpr int kSide = QJ_REFLECTANCE_SIDE;
  constexpr double kLeastCosine = 0.02;
  std::vector<float> table;
  for (int row = 0; row < kSide; ++row) {
    for (int column = 0; column < kSide; ++column) {
      const auto [a, b] =
          share_of(std::max(double(column) / (kSide - 1), kLeastCosine), double(row) / (kSide - 1));
      table.push_back(static_cast<float>(a));
      table.push_back(static_cast<float>(b));
    }
  }
  return table;
}

}  // namespace

const std::vector<float>& reflectance_table() {
  static const std::vector<float> table = made_table();
  return table;
}

}  // namespace qjulia::picture
