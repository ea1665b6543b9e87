#include "picture/framing.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include "picture/view.hpp"
#include "qjulia/base/progress.hpp"

namespace qjulia::picture {
namespace {

using Eigen::Vector3d;
using Points = Eigen::Matrix3Xd;

/// Share of the picture's tighter side that is filled.
constexpr double kFilled = 0.83;
/// Number of directions in which extremes are sought, evenly over the sphere.
constexpr int kDirections = 256;
/// The eye keeps at least this distance from the outline, as a share of the outline's size.
constexpr double kClear = 0.05;
/// Number of steps that the search for a common middle takes; their lengths are 1/4, 1/6, 1/8 … of
/// the outline's size.
constexpr int kSteps = 400;

Points matrix_of(std::span<const Vector3d> points) {
  Points all(3, static_cast<Eigen::Index>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i) all.col(static_cast<Eigen::Index>(i)) = points[i];
  return all;
}

/// A side of a camera's pyramid of rays, or of the box that parallel rays fill. All points lie
/// within it when the eye is at least (reach − normal · middle) / tangent away from the middle of
/// the picture.
struct Side {
  Vector3d normal;
  double tangent;
  double reach;   ///< of the outline along the normal
  bool is_level;  ///< left or right

  double distance(const Vector3d& middle) const { return (reach - normal.dot(middle)) / tangent; }
};

/// The sides of the narrower pyramid that the outline is to fill.
std::array<Side, 4> sides_of(const Camera& camera, const Points& outline, double aspect) {
  const CameraAxes axes = camera_axes(camera);
  const double tan_y = kFilled * half_height(camera), nearing = is_parallel(camera) ? 0 : 1;
  const auto side = [&](const Vector3d& across, double tangent, bool is_level) {
    const Vector3d normal = across + nearing * tangent * axes.back;
    return Side{normal, tangent, (normal.transpose() * outline).maxCoeff(), is_level};
  };
  return {side(axes.right, aspect * tan_y, true), side(-axes.right, aspect * tan_y, true),
          side(axes.up, tan_y, false), side(-axes.up, tan_y, false)};
}

/// An eye's place along an axis across the view, and along the view's axis.
struct Place {
  double across, back;
};

/// The nearest place from which the whole outline is seen within this tangent to both sides.
/// @param back zero for parallel rays
Place nearest_place(const Points& outline, const Vector3d& across, const Vector3d& back,
                    double tangent) {
  const Vector3d axis = tangent * back;
  const double to_right = ((axis + across).transpose() * outline).maxCoeff();
  const double to_left = ((axis - across).transpose() * outline).maxCoeff();
  return {0.5 * (to_right - to_left), 0.5 * (to_right + to_left) / tangent};
}

/// How far the eye stays from the nearest part of the outline; otherwise a needle that points at
/// the eye could touch it.
double clearance(const Points& outline) {
  return kClear * (outline.rowwise().maxCoeff() - outline.rowwise().minCoeff()).norm();
}

/// The place across the view at which an eye so far back has equal room to both sides.
double middle_place(const Points& outline, const Vector3d& across, const Vector3d& back,
                    double tangent, double so_far) {
  // The narrower the view, the farther back is the place.
  double low = 0, high = tangent;
  for (int halving = 0; halving < 50; ++halving) {
    const double middle = 0.5 * (low + high);
    (nearest_place(outline, across, back, middle).back > so_far ? low : high) = middle;
  }
  return nearest_place(outline, across, back, high).across;
}

/// The point at which a camera must look so that the outline is in the middle and as large as
/// possible.
Vector3d middle_for(const Camera& camera, const Points& outline, double aspect) {
  const CameraAxes axes = camera_axes(camera);
  const double tan_y = kFilled * half_height(camera);
  const double tan_x = aspect * tan_y;
  const Eigen::RowVectorXd depths = axes.back.transpose() * outline;
  // Parallel rays show the same from any distance.
  const Vector3d nearing = is_parallel(camera) ? Vector3d::Zero() : axes.back;
  double back = std::max(nearest_place(outline, axes.right, nearing, tan_x).back,
                         nearest_place(outline, axes.up, nearing, tan_y).back);
  if (!is_parallel(camera)) back = std::max(back, depths.maxCoeff() + clearance(outline));
  return middle_place(outline, axes.right, nearing, tan_x, back) * axes.right +
         middle_place(outline, axes.up, nearing, tan_y, back) * axes.up +
         0.5 * (depths.minCoeff() + depths.maxCoeff()) * axes.back;
}

/// The same point for several cameras: its level and upright parts move, by shorter and shorter
/// steps, towards the side of a view that demands the greatest distance.
Vector3d middle_for(const std::vector<Side>& sides, const Points& outline, const Vector3d& up) {
  const Vector3d low = outline.rowwise().minCoeff(), high = outline.rowwise().maxCoeff();
  Vector3d middle = 0.5 * (low + high), best = middle;
  double least = std::numeric_limits<double>::infinity();
  for (int step = 1; step <= kSteps; ++step) {
    std::array<const Side*, 2> farthest{};
    for (const Side& side : sides) {
      const Side*& held = farthest.at(side.is_level ? 0 : 1);
      if (held == nullptr || side.distance(middle) > held->distance(middle)) held = &side;
    }
    const auto [level, upright] = farthest;
    const double distance = std::max(level->distance(middle), upright->distance(middle));
    // Where only one of the two sides decides, the other part still moves on to its own middle.
    if (distance <= least * (1 + 1e-3)) {
      least = std::min(least, distance);
      best = middle;
    }
    const double length = 0.5 * (high - low).norm() / (step + 1);
    const Vector3d across = level->normal - up.dot(level->normal) * up;
    const Vector3d along = up.dot(upright->normal) * up;
    if (across.norm() > 0) middle += length * across.normalized();
    if (along.norm() > 0) middle += length * along.normalized();
  }
  return best;
}

bool looks_alike(const Camera& a, const Camera& b) {
  return a.azimuth == b.azimuth && a.elevation == b.elevation && a.up == b.up;
}

}  // namespace

std::vector<Vector3d> extremes(const std::vector<Vector3d>& points, const std::stop_token& stop) {
  if (points.empty()) return {};
  const Points all = matrix_of(points);
  std::vector<Eigen::Index> numbers;
  // A Fibonacci spiral.
  for (int i = 0; i < kDirections; ++i) {
    throw_if_stopped(stop);
    const double z = 1 - (2 * i + 1.0) / kDirections, r = std::sqrt(1 - z * z);
    const double around = std::numbers::pi * (1 + std::sqrt(5.0)) * i;
    Eigen::Index farthest = 0;
    (Eigen::RowVector3d(r * std::cos(around), r * std::sin(around), z) * all).maxCoeff(&farthest);
    numbers.push_back(farthest);
  }
  std::ranges::sort(numbers);
  numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
  std::vector<Vector3d> found;
  found.reserve(numbers.size());
  for (const Eigen::Index i : numbers) found.push_back(points[static_cast<std::size_t>(i)]);
  return found;
}

std::vector<Camera> aimed(std::span<const Camera> cameras, std::span<const Vector3d> outline,
                          double aspect) {
  std::vector<Camera> all(cameras.begin(), cameras.end());
  if (all.empty()) return all;
  const Points points = matrix_of(outline);
  std::vector<Side> sides;
  for (const Camera& camera : all) {
    for (const Side& side : sides_of(camera, points, aspect)) sides.push_back(side);
  }
  const bool is_one_view = std::ranges::all_of(
      all, [&](const Camera& camera) { return looks_alike(camera, all.front()); });
  const Vector3d middle =
      is_one_view ? middle_for(all.front(), points, aspect)
                  : middle_for(sides, points, direction(all.front().up.value_or(kDefaultUp)));
  std::map<double, double> distances;  // by field of view
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Vector3d back = camera_axes(all[i]).back;
    const double nearest = (back.transpose() * points).maxCoeff() - back.dot(middle);
    double& distance = distances[all[i].field_of_view];
    if (!is_parallel(all[i])) distance = std::max(distance, nearest + clearance(points));
    for (std::size_t k = 4 * i; k < 4 * (i + 1); ++k) {
      distance = std::max(distance, sides[k].distance(middle));
    }
  }
  for (Camera& camera : all) {
    if (!camera.look_at) camera.look_at = camera.frame ? camera.frame->center() : middle;
    if (!camera.distance) camera.distance = distances.at(camera.field_of_view);
  }
  return all;
}

}  // namespace qjulia::picture
