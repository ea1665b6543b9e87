#pragma once
/// The binary .ply that this program writes: a header, then a record for each vertex and each
/// triangle.

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>

#include "qjulia/mesh/mesh.hpp"

namespace qjulia::shape {

/// What vertices have besides x, y and z, in this order: nx, ny, nz; red, green and blue as bytes.
struct VertexParts {
  bool normals = false, colors = false;
};

/// What stands before the records.
/// @param note a line of text for comments, 200 characters in each; none where it is empty.
std::string ply_header(std::size_t vertices, std::size_t triangles, VertexParts parts,
                       const std::string& note);

/// A vertex with a normal: x, y, z, nx, ny, nz.
using PlyVertex = std::array<float, 6>;

/// A triangle: a byte with the number of corners, then the corners.
struct PlyFace {
  std::array<char, 1 + sizeof(Triangle)> bytes;

  explicit PlyFace(const Triangle& corners = {}) : bytes{3} {
    std::memcpy(bytes.data() + 1, corners.data(), sizeof corners);
  }
  Triangle corners() const {
    Triangle corners;
    std::memcpy(corners.data(), bytes.data() + 1, sizeof corners);
    return corners;
  }
};
static_assert(sizeof(PlyFace) == 13);

}  // namespace qjulia::shape
