#pragma once
/// Finds nearest points and first hits on a mesh's triangles, on the host in double precision.

#include <Eigen/Core>
#include <cstddef>
#include <stop_token>
#include <vector>

#include "mesh/bvh.hpp"
#include "qjulia/mesh/mesh.hpp"

namespace qjulia::shape {

/// For thousands of queries. Millions belong on a device (`SignedDistance`). All lengths are in the
/// mesh's units.
class TriangleTree {
 public:
  /// @param stop ends building: Interrupted.
  explicit TriangleTree(const TriangleMesh& mesh, std::stop_token stop = {});

  struct Nearest {
    Eigen::Vector3d position;
    double distance;           ///< infinite if the mesh has no triangle
    std::size_t triangle = 0;  ///< the mesh's, in which the position lies
  };
  /// The point of the mesh nearest to `p`, or one that is farther away by at most the share
  /// `slack`. All triangles of a ball are about equally near to its middle; with a little slack,
  /// most of them need not be looked at.
  Nearest nearest(const Eigen::Vector3d& p, double slack = 0) const;

  /// How far a ray goes from `origin` along the unit vector `direction` before it meets a triangle;
  /// infinite if it meets none. Hits within `least` of the origin do not count.
  double first_hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                   double least) const;

 private:
  /// Two planes between which the triangles of a node lie. If these are nearly flat, the planes
  /// bound the distance better than the node's box does.
  struct Slab {
    Eigen::Vector3d normal;
    double low, high;  ///< normal · x of the planes
  };

  /// Sets the slabs of a node and of those below it.
  /// @return where the node's triangles end in the order of the leaves.
  std::size_t set_slabs(std::size_t node, std::size_t first, const std::stop_token& stop);
  double squared_bound(const Eigen::Vector3d& p, std::size_t node) const;

  Bvh bvh_;
  std::vector<Slab> slabs_;  ///< one for each node
};

}  // namespace qjulia::shape
