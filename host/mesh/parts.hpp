#pragma once
/// The connected parts of a mesh, and which of them are wound inside out.

#include <cstddef>
#include <cstdint>
#include <stop_token>
#include <vector>

#include "mesh/cone_sum.hpp"
#include "qjulia/mesh/mesh.hpp"

namespace qjulia::shape {

constexpr std::size_t kTrianglesPolled = std::size_t{1} << 16;  ///< between two polls

/// Triangles that share vertices belong to the same part.
struct Parts {
  std::vector<std::uint32_t> of_triangle;  ///< the number of each triangle's part
  std::vector<ConeSum> sums;               ///< by part; the apex is the middle of the mesh's box

  std::size_t size() const { return sums.size(); }
  /// The volume that `qjulia::signed_volume` would give.
  double signed_volume() const;
};

/// @throws Interrupted
Parts connected_parts(const TriangleMesh& mesh, const std::stop_token& stop = {});

/// Which parts `oriented_outward` turns.
/// @throws Interrupted
std::vector<bool> parts_inside_out(const TriangleMesh& mesh, const Parts& parts,
                                   const std::stop_token& stop = {});

}  // namespace qjulia::shape
