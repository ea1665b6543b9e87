#include <algorithm>
#include <cmath>

#include "qjulia/picture/light.hpp"

namespace qjulia {
namespace {

/// Khronos PBR Neutral 1.0, Specification (2024).
Rgb neutral(const Rgb& radiance) {
  constexpr double kReflected = 0.04, kStart = 0.8 - kReflected, kDesaturation = 0.15;
  const double least = radiance.minCoeff();
  const double offset =
      least < 2 * kReflected ? least - least * least / (4 * kReflected) : kReflected;
  Rgb color = radiance.array() - offset;
  const double peak = color.maxCoeff();
  if (peak < kStart) return color;
  const double rest = 1 - kStart;
  const double new_peak = 1 - rest * rest / (peak + rest - kStart);
  const double white = 1 - 1 / (kDesaturation * (peak - new_peak) + 1);
  return color * (new_peak / peak) * (1 - white) + Rgb::Constant(new_peak * white);
}

/// AgX (Sobotka 2022) with the sigmoid as a polynomial of degree 6 (Wrensch 2023).
Rgb agx(const Rgb& radiance) {
  constexpr double kLeast = -12.47393, kMost = 4.026069;  // log2 of radiance
  Eigen::Matrix3d inset;
  inset << 0.842479062253094, 0.0784335999999992, 0.0792237451477643,  //
      0.0423282422610123, 0.878468636469772, 0.0791661274605434,       //
      0.0423756549057051, 0.0784336, 0.879142973793104;
  Rgb c = inset * radiance;
  for (double& v : c) {
    const double x =
        std::clamp((std::log2(std::max(v, 1e-10)) - kLeast) / (kMost - kLeast), 0., 1.);
    v = (((((15.5 * x - 40.14) * x + 31.96) * x - 6.868) * x + 0.4298) * x + 0.1191) * x - 0.00232;
  }
  c = inset.inverse() * c;
  return c.cwiseMax(0).array().pow(2.2).cwiseMin(1);
}

/// Narkowicz 2015, "ACES filmic tone mapping curve".
Rgb aces(const Rgb& radiance) {
  const Eigen::Array3d c = radiance.array();
  return ((c * (2.51 * c + 0.03)) / (c * (2.43 * c + 0.59) + 0.14)).cwiseMin(1);
}

}  // namespace

Rgb tone_mapped(ToneCurve curve, const Rgb& radiance) {
  const Rgb c = radiance.cwiseMax(0);
  switch (curve) {
    case ToneCurve::neutral:
      return neutral(c);
    case ToneCurve::agx:
      return agx(c);
    case ToneCurve::aces:
      return aces(c);
    case ToneCurve::none:
      break;
  }
  return c.cwiseMin(1);
}

}  // namespace qjulia
