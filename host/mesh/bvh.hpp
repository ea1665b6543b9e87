#pragma once
/// A bounding volume hierarchy of triangles, flattened as layout/bvh.h says.

#include <cstdint>
#include <stop_token>
#include <vector>

#include "qjulia/mesh/mesh.hpp"

namespace qjulia::shape {

struct Bvh {
  std::vector<double> nodes;         ///< QJ_NODE_REALS each
  std::vector<std::int32_t> links;   ///< QJ_NODE_INTS each
  std::vector<double> triangles;     ///< QJ_TRIANGLE_REALS each, in the order of the leaves
  std::vector<std::uint32_t> order;  ///< the index in the mesh of each of these triangles

  /// Binned surface-area heuristic (Wald 2007) with median splits below a fixed depth; the same
  /// tree for the same mesh. Each node carries the dipole of its triangles (Barill et al. 2018),
  /// used beyond `accuracy` (their beta) times its radius.
  /// @param stop ends building.
  Bvh(const TriangleMesh& mesh, double accuracy, std::stop_token stop = {});
};

}  // namespace qjulia::shape
