#include <algorithm>
#include <array>
#include <cmath>

#include "base/larger_error.hpp"
#include "base/srgb.hpp"
#include "check/checks.hpp"
#include "check/shading_probe.hpp"
#include "check/unit_ball.hpp"
#include "picture/band_grid.hpp"
#include "picture/depth_grid.hpp"
#include "picture/depth_source.hpp"
#include "profile/workload.hpp"
#include "qjulia/picture/picture.hpp"

namespace qjulia::check {
namespace {

using base::larger_error;
using Eigen::Vector3d;
using profiling::largest_difference;

/// Depths of the ball along parallel rays that meet it well inside its outline, where a ray's own
/// tolerance is the unit.
template <bool kCoarse>
double depths(const Device& device, Precision precision) {
  constexpr double kLeastSlope = 0.447;  // cosine of the angle between the ray and the normal
  const auto source = picture::march_source(device, {unit_ball(), 6, {}, {}, precision});
  picture::View view = picture::parallel_view(Vector3d::UnitZ(), *unit_ball().frame.box, 48);
  view.coarse_will_do = kCoarse;
  const auto found = source->depths(view, 0, view.rows);
  double worst = 0;
  std::size_t hits = 0;
  for (int row = 0; row < view.rows; ++row) {
    for (int column = 0; column < view.columns; ++column) {
      const double right = check::sphere_depth(view, column, row);
      if (right < 0) continue;
      const Vector3d normal =
          check::ray_start(view, column, row) + right * check::ray_direction(view, column, row);
      const double slope = -normal.dot(check::ray_direction(view, column, row));
      if (slope < kLeastSlope) continue;
      const double depth = found[picture::index(column, row, view.columns)];
      worst = larger_error(worst, depth < 0 ? kInfinite : std::abs(depth - right) * slope);
      ++hits;
    }
  }
  return hits > 0 ? worst / view.tolerance : kInfinite;
}

/// Compares traits of points just inside the unit sphere. A point at an angle t to the real axis
/// has iterates at 2t and 4t.
double orbit_trait(const Device& device, Precision precision) {
  const auto source =
      picture::march_source(device, {unit_ball(), 6, {}, {}, precision, Material::trap});
  std::vector<Vector3d> points;
  std::vector<double> right;
  for (int i = 0; i < 100; ++i) {
    const double t = 0.1 + 0.02 * i;
    constexpr double kRadius = 0.998;
    points.push_back(kRadius * Vector3d(std::cos(t), 0.6 * std::sin(t), 0.8 * std::sin(t)));
    right.push_back(std::min(std::abs(std::cos(2 * t)), std::abs(std::cos(4 * t))));
  }
  constexpr double kWidth = 1e-4;
  const auto found = source->traits(points, std::span(&kWidth, 1));
  return largest_difference({found.begin(), found.end()}, right);
}

/// Normals of a picture of the ball, which its positions are too, away from its outline.
double shade(const Device& device, Precision precision) {
  PictureOptions options;
  options.width = 64;
  options.height = 48;
  options.samples = 1;
  options.precision = precision;
  const PictureLayers layers = layered_render(device, unit_ball(), options).layers;
  constexpr int kMargin = 3;
  const auto pixel = [&](int column, int row) {
    return picture::index(column, row, options.width);
  };
  const auto is_inside = [&](int column, int row) {
    for (int y = row - kMargin; y <= row + kMargin; ++y) {
      for (int x = column - kMargin; x <= column + kMargin; ++x) {
        if (std::isinf(layers.depth[pixel(x, y)])) return false;
      }
    }
    return true;
  };
  const auto vector = [&](const std::vector<float>& layer, std::size_t at) {
    return Vector3d(layer[3 * at], layer[3 * at + 1], layer[3 * at + 2]);
  };
  double worst = 0;
  std::size_t hits = 0;
  for (int row = kMargin; row < options.height - kMargin; ++row) {
    for (int column = kMargin; column < options.width - kMargin; ++column) {
      if (!is_inside(column, row)) continue;
      const std::size_t at = pixel(column, row);
      const Vector3d right = vector(layers.position, at).normalized();
      worst = larger_error(worst, (vector(layers.normal, at) - right).norm());
      ++hits;
    }
  }
  return hits > 100 ? worst : kInfinite;
}

/// Colours of the default tone curve, in steps of a byte; and whether white in even light is white
/// whatever its roughness, in hundredths.
double develop(const Device& device, Precision) {
  std::array<Rgb, 24> radiances;
  for (int i = 0; i < 24; ++i) {
    radiances[static_cast<std::size_t>(i)] = {0.08 * i, 0.02 * i * i, 0.3};
  }
  const auto bytes = developed(device, ToneCurve::neutral, radiances);
  double worst = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const Rgb color = tone_mapped(ToneCurve::neutral, radiances[i / 3]);
    const double right = 255 * base::srgb_encoded(color[static_cast<Eigen::Index>(i % 3)]);
    worst = larger_error(worst, std::abs(bytes[i] - right));
  }
  const std::vector<Vector3d> normals(1, Vector3d(0.6, 0, 0.8));
  for (const double roughness : {0.0, 0.5, 1.0}) {
    ShadingProbe probe{.even_light = 1};
    probe.scene.options.palette.clay = Rgb::Ones();
    probe.scene.options.matter.roughness = roughness;
    worst = larger_error(worst, 100 * (probe.radiance(device, normals)[0] - Rgb::Ones()).norm());
  }
  return worst;
}

constexpr std::array kPictureChecks{
    Check{"ray_march.cl", "depths of a ball, in a ray's tolerance", 1, 1, depths<false>, true},
    Check{"ray_grid.cl", "coarse depths of a ball, in the same", 2, 2, depths<true>},
    Check{"orbit_trait.cl", "angles of a ball's orbits", 1e-4, 1e-6, orbit_trait},
    Check{"shade.cl", "normals of a ball", 0.1, 0.1, shade},
    Check{"develop.cl", "colours in steps of a byte, and white in even light", 1.1, 1.1, develop},
};

}  // namespace

std::span<const Check> picture_checks() { return kPictureChecks; }

}  // namespace qjulia::check
