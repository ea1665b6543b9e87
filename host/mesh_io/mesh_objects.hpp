#pragma once
/// The bodies of a mesh: connected parts, together with their cavities.

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "mesh/parts.hpp"
#include "qjulia/mesh/mesh.hpp"

namespace qjulia::shape {

/// Which parts belong together.
struct Objects {
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  Parts parts;
  std::vector<std::uint32_t> of_part;  ///< the number of each part's object
  std::size_t count = 0;

  std::uint32_t of_triangle(std::size_t triangle) const {
    return of_part[parts.of_triangle[triangle]];
  }
  bool is_cavity(std::size_t part) const {
    return parts.sums[part].is_closed() && parts.sums[part].volume < 0;
  }
};

/// A part that encloses a negative volume is a cavity: it belongs to the part with the smallest box
/// that its own box lies in.
Objects objects_of(const TriangleMesh& mesh);

}  // namespace qjulia::shape
