#include "picture/view.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "layout/picture_layout.h"

namespace qjulia::picture {
namespace {

using Eigen::Vector3d;

/// A set's shell reaches beyond the shape it was fitted to, by less than this share of its size.
constexpr double kShell = 1.06;
/// Share of the frame that the cylinder may fill: shapes seldom reach its rims.
constexpr double kFill = 0.96;

/// Half of the extent along a unit vector of what is framed: the box's upright elliptic cylinder,
/// that stands as high as the box and whose ellipse is a little larger than the one that fits in.
double extent(const Box& box, const Vector3d& up, const Vector3d& unit) {
  const Vector3d reach = 0.5 * kShell * box.size().cwiseProduct(unit.cwiseAbs());
  const double upright = reach.dot(up.cwiseAbs());
  return upright + std::sqrt(reach.squaredNorm() - upright * upright);
}

/// Distance at which that cylinder fits a frame with these tangents of its half angles.
double framing_distance(const Camera& camera, const Box& box, double tan_x, double tan_y) {
  double distance = 0;
  const Vector3d up = direction(camera.up.value_or(kDefaultUp));
  const double nearing = is_parallel(camera) ? 0 : 1;
  Camera turned = camera;
  for (int azimuth = 0; azimuth < 360; azimuth += 5) {
    turned.azimuth = azimuth;
    const CameraAxes axes = camera_axes(turned);
    // The support function of the cylinder along each side plane's normal.
    const auto from = [&](const Vector3d& across, double tangent) {
      const Vector3d normal = across + nearing * tangent * axes.back;
      return extent(box, up, normal.normalized()) * normal.norm() / tangent;
    };
    for (const double sign : {-1.0, 1.0}) {
      distance = std::max({distance, from(sign * axes.right, tan_x), from(sign * axes.up, tan_y)});
    }
  }
  return distance;
}

/// By how much the view of `whole` is narrowed so that `frame` fills it from the same distance.
double narrowing(const Camera& camera, const Box& frame, double distance, double tan_x,
                 double tan_y) {
  // The distance rises with the narrowing.
  double low = 1e-3, high = 1e6;
  for (int halving = 0; halving < 60; ++halving) {
    const double middle = std::sqrt(low * high);
    const bool fits = framing_distance(camera, frame, tan_x / middle, tan_y / middle) < distance;
    (fits ? low : high) = middle;
  }
  return low;
}

}  // namespace

View View::coarse() const {
  View view = *this;
  view.columns /= samples;
  view.rows /= samples;
  view.samples = 1;
  for (Vector3d* step : {&view.eye_dx, &view.eye_dy, &view.dir_dx, &view.dir_dy}) *step *= samples;
  view.footprint *= samples;
  return view;
}

std::vector<double> View::packed() const {
  std::vector<double> reals(QJ_VIEW_SIZE);
  Eigen::Map<Eigen::VectorXd> layout(reals.data(), QJ_VIEW_SIZE);
  layout.segment<3>(QJ_VIEW_EYE) = eye;
  layout.segment<3>(QJ_VIEW_EYE_DX) = eye_dx;
  layout.segment<3>(QJ_VIEW_EYE_DY) = eye_dy;
  layout.segment<3>(QJ_VIEW_DIR) = dir;
  layout.segment<3>(QJ_VIEW_DIR_DX) = dir_dx;
  layout.segment<3>(QJ_VIEW_DIR_DY) = dir_dy;
  return reals;
}

CameraAxes camera_axes(const Camera& camera) {
  const UpAxis up_axis = camera.up.value_or(kDefaultUp);
  const Vector3d up = direction(up_axis);
  const Vector3d front = Vector3d::Unit((axis_number(up_axis) + 1) % 3);
  const Vector3d side = up.cross(front);
  const double a = camera.azimuth * kDegree, e = camera.elevation * kDegree;
  CameraAxes axes;
  const Vector3d level = std::cos(a) * front + std::sin(a) * side;
  axes.back = std::cos(e) * level + std::sin(e) * up;
  axes.right = -std::sin(a) * front + std::cos(a) * side;
  axes.up = axes.back.cross(axes.right);
  return axes;
}

bool is_parallel(const Camera& camera) { return camera.field_of_view == 0; }

double half_height(const Camera& camera) {
  const double degrees = is_parallel(camera) ? Camera{}.field_of_view : camera.field_of_view;
  return std::tan(0.5 * degrees * kDegree);
}

View camera_view(const Camera& camera, const Box& framed, int width, int height, int samples) {
  const int columns = width * samples, rows = height * samples;
  const CameraAxes axes = camera_axes(camera);
  const double tan_y = half_height(camera);
  const double tan_x = tan_y * columns / rows;
  const double distance = camera.distance
                              ? *camera.distance
                              : framing_distance(camera, framed, kFill * tan_x, kFill * tan_y);
  const double narrowed =
      camera.frame ? narrowing(camera, *camera.frame, distance, kFill * tan_x, kFill * tan_y) : 1;
  const double pixel = 2 * tan_y / rows / (narrowed * camera.zoom);
  View view;
  view.columns = columns;
  view.rows = rows;
  view.samples = samples;
  const Vector3d middle = camera.look_at.value_or(camera.frame.value_or(framed).center());
  const Vector3d dx = pixel * axes.right, dy = -pixel * axes.up;
  const Vector3d to_corner = -0.5 * columns * dx - 0.5 * rows * dy;
  if (is_parallel(camera)) {
    const double outside = distance + (middle - framed.center()).norm() + framed.diagonal();
    view.eye_dx = distance * dx;
    view.eye_dy = distance * dy;
    view.eye = middle + outside * axes.back + distance * to_corner;
    view.dir = -axes.back;
  } else {
    view.dir_dx = dx;
    view.dir_dy = dy;
    view.eye = middle + distance * axes.back;
    view.dir = -axes.back + to_corner;
  }
  view.footprint = distance * pixel;
  view.tolerance = view.footprint / 4;
  return view;
}

View parallel_view(const Vector3d& towards, const Box& box, int size) {
  const Vector3d right = towards.unitOrthogonal();
  const Vector3d up = towards.cross(right);
  const auto half = [&](const Vector3d& unit) { return 0.5 * box.size().dot(unit.cwiseAbs()); };
  View view;
  view.columns = view.rows = size;
  view.footprint = 2 * std::max(half(right), half(up)) / size;
  view.tolerance = view.footprint / 2;
  view.eye_dx = view.footprint * right;
  view.eye_dy = -view.footprint * up;
  view.dir = -towards;
  view.eye = box.center() + half(towards) * towards - 0.5 * size * (view.eye_dx + view.eye_dy);
  return view;
}

}  // namespace qjulia::picture
