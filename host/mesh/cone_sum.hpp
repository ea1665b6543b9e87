#pragma once
/// The volume that triangles enclose.

#include <Eigen/Geometry>

namespace qjulia::shape {

/// Sums over triangles of the cones on them, whose apex is the origin.
struct ConeSum {
  Eigen::Vector3d normals = Eigen::Vector3d::Zero();    ///< as long as the triangle is large
  Eigen::Vector3d centroids = Eigen::Vector3d::Zero();  ///< times area
  double area = 0;
  double volume = 0;

  ConeSum() = default;
  ConeSum(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c)
      : normals(0.5 * (b - a).cross(c - a)), area(normals.norm()), volume(normals.dot(a) / 3) {
    centroids = area * (a + b + c) / 3;
  }

  ConeSum& operator+=(const ConeSum& other) {
    normals += other.normals;
    centroids += other.centroids;
    area += other.area;
    volume += other.volume;
    return *this;
  }
  /// Normals of a closed surface cancel, and its volume is the same for every apex.
  bool is_closed() const { return normals.norm() <= 1e-6 * area; }
  /// The volume of the cones whose apex is the surface's centroid. Moving the apex by m changes it
  /// by −m · sum of normals / 3.
  double volume_from_centroid() const {
    return area > 0 ? volume - normals.dot(centroids / area) / 3 : volume;
  }
};

}  // namespace qjulia::shape
