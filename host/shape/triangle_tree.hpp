#pragma once
/// Queries of a mesh's triangles on the host, in double precision.

#include <Eigen/Core>
#include <cstddef>
#include <stop_token>
#include <vector>

#include "qjulia/mesh.hpp"
#include "shape/bvh.hpp"

namespace qjulia::shape {

/// Thousands of queries; millions belong on a device (`SignedDistance`).
class TriangleTree {
 public:
  /// @param stop ends building: Interrupted.
  explicit TriangleTree(const TriangleMesh& mesh, std::stop_token stop = {});

  struct Nearest {
    Eigen::Vector3d position;
    double distance;  ///< infinite where the mesh has no triangle
  };
  /// The point of the mesh nearest to `p`, or one that is farther by at most `slack` of its
  /// distance. A point in the middle of a ball has all triangles about equally near: a little slack
  /// spares looking at most of them.
  Nearest nearest(const Eigen::Vector3d& p, double slack = 0) const;

  /// How far a ray goes from `origin` along the unit vector `direction` before it meets a triangle,
  /// those within `least` of the origin left out; infinite where it meets none.
  double first_hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                   double least) const;

 private:
  /// The triangles of a node lie between two planes, which bound the distance better than its box
  /// where they are about flat.
  struct Slab {
    Eigen::Vector3d normal;
    double low, high;  ///< normal · x of the planes
  };

  /// Of a node and those below it. @return where its triangles end in the order of the leaves.
  std::size_t set_slabs(std::size_t node, std::size_t first, const std::stop_token& stop);
  double squared_bound(const Eigen::Vector3d& p, std::size_t node) const;

  Bvh bvh_;
  std::vector<Slab> slabs_;  ///< of the nodes
};

}  // namespace qjulia::shape
