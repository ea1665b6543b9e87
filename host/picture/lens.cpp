#include "picture/lens.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <numeric>

namespace qjulia::picture {
namespace {

using Eigen::Vector3d;

/// The ray through the middle of the picture.
Vector3d axis_of(const View& view) {
  return view.direction(0.5 * view.columns, 0.5 * view.rows).normalized();
}

/// Number i of a sequence that fills -½ … ½ evenly and begins with 0: multiples of a power of the
/// plastic number (Roberts 2018).
double spread(int i, double step) {
  const double at = i * step + 0.5;
  return at - std::floor(at) - 0.5;
}

}  // namespace

double distance_along_axis(const View& view, const Vector3d& point) {
  return (point - view.eye).dot(axis_of(view));
}

View lens_view(const View& view, double width, double focus, int i, int count) {
  constexpr double kPlastic = 1.32471795724474602596;
  const Vector3d right = (view.dir_dx + view.eye_dx).normalized();
  const Vector3d up = (view.dir_dy + view.eye_dy).normalized();
  const double aside = spread(i, 1 / kPlastic), down = spread(i, 1 / (kPlastic * kPlastic));
  // Directions reach so far along the axis, and meet the plane in focus after so many of them.
  const double reach = view.direction(0.5 * view.columns, 0.5 * view.rows).norm();
  const double golden_angle = std::numbers::pi * (3 - std::sqrt(5.0));
  const double radius = 0.5 * width * focus * std::sqrt(static_cast<double>(i) / count);
  const Vector3d away =
      radius * (std::cos(golden_angle * i) * right + std::sin(golden_angle * i) * up);
  View through = view;
  through.lens_eye = view.eye;
  through.eye += aside * view.eye_dx + down * view.eye_dy + away;
  through.dir += aside * view.dir_dx + down * view.dir_dy - away * (reach / focus);
  return through;
}

int open_part(int i, int count) {
  // Multiples of a number that has no factor in common with `count` reach all parts.
  int step = std::max(1, static_cast<int>(std::lround(count / std::numbers::phi)));
  while (std::gcd(step, count) != 1) ++step;
  return static_cast<int>(std::int64_t{step} * i % count);
}

}  // namespace qjulia::picture
