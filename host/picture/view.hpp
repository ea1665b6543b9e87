#pragma once
/// Where rays come from: perspective views for cameras, parallel ones for lights.

#include <Eigen/Core>
#include <numbers>
#include <optional>
#include <vector>

#include "qjulia/picture/picture.hpp"

namespace qjulia::picture {

inline constexpr double kDegree = std::numbers::pi / 180;  ///< in radians

/// `columns` × `rows` rays. The ray of pixel coordinates (x, y), pixel centres at halves, y
/// downward, starts at eye + x eye_dx + y eye_dy and runs along dir + x dir_dx + y dir_dy; depth
/// is the length along it.
struct View {
  int columns = 0;
  int rows = 0;
  Eigen::Vector3d eye{0, 0, 0}, eye_dx{0, 0, 0}, eye_dy{0, 0, 0};
  Eigen::Vector3d dir{0, 0, 0}, dir_dx{0, 0, 0}, dir_dy{0, 0, 0};
  double footprint = 0;         ///< width of a pixel at the middle of the scene
  double tolerance = 0;         ///< in depths
  int samples = 1;              ///< pixels on each side of a square that belong together
  bool coarse_will_do = false;  ///< depths may come from a grid that smooths fine detail
  /// Where rays of a pin-hole in the middle of the lens start, for a view through another point of
  /// it: what is looked up for those rays serves these, too.
  std::optional<Eigen::Vector3d> lens_eye{};

  Eigen::Vector3d origin(double x, double y) const { return eye + x * eye_dx + y * eye_dy; }
  Eigen::Vector3d direction(double x, double y) const { return dir + x * dir_dx + y * dir_dy; }
  Eigen::Vector3d at(double x, double y, double depth) const {
    return origin(x, y) + depth * direction(x, y).normalized();
  }

  /// The view whose pixels are this one's squares of `samples` × `samples`.
  View coarse() const;

  /// The buffer that layout/picture_layout.h describes.
  std::vector<double> packed() const;
};

/// Right-handed axes of a camera; `back` points from the scene to the eye.
struct CameraAxes {
  Eigen::Vector3d right, up, back;
};

/// Azimuth 0 looks against the axis that follows `up` in the cycle x, y, z: for up = y it looks
/// along −z.
CameraAxes camera_axes(const Camera& camera);

/// Whether its rays are parallel.
bool is_parallel(const Camera& camera);

/// Half of the picture's height at distance 1, at zoom 1.
double half_height(const Camera& camera);

/// The camera's view from its distance, or if its rays are parallel, from far enough outside. A
/// camera without a distance frames a box: the upright elliptic cylinder in it and a shell around
/// it, with a margin, from the same distance at every azimuth. Where the camera has a frame of its
/// own, the view is narrowed to the cylinder in that frame. The camera looks at its `look_at`, else
/// at the middle of what is framed; all are in the box's coordinates. The view's pixels are the
/// picture's samples, `samples` × `samples` a pixel.
View camera_view(const Camera& camera, const Box& framed, int width, int height, int samples);

/// Parallel rays along −`towards` over the box, `size` × `size`.
View parallel_view(const Eigen::Vector3d& towards, const Box& box, int size);

}  // namespace qjulia::picture
