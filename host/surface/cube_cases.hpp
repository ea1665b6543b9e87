#pragma once
/// The 256 ways a surface can cross a grid cell, as triangles between points on the cell's edges.

#include <array>
#include <cstdint>
#include <vector>

namespace qjulia::surface {

/// Corner c of a cell lies at (c & 1, c >> 1 & 1, c >> 2 & 1). Edge 4 a + b runs along axis a from
/// the corner whose other two coordinates, in rising order of axis, are (b & 1, b >> 1).
struct CubeEdge {
  int axis;
  int low;   ///< corner at its lower end
  int high;  ///< corner at its upper end
};
const std::array<CubeEdge, 12>& cube_edges();

/// One closed loop of crossed edges, counter-clockwise from outside, cut into triangles.
struct CubeLoop {
  std::vector<std::uint8_t> edges;
  std::vector<std::uint8_t> triangles;  ///< numbers of edges, three a triangle
};

/// Loops by case: bit c is set when corner c is inside.
///
/// On every face the inside corners are separated: each run of inside corners is cut off by one
/// segment. The rule sees only the face, so both cells at a face agree on its segments, every
/// segment bounds exactly one triangle of either cell, and the surface is closed. No triangle has
/// an inner edge between two points of one face, so no inner edge can meet another one of the
/// neighbour: the surface is 2-manifold.
const std::array<std::vector<CubeLoop>, 256>& cube_cases();

/// The segments that a case leaves on face 2 · axis + side, as pairs (from edge, to edge).
std::vector<std::array<std::uint8_t, 2>> face_segments(unsigned inside, int face);

}  // namespace qjulia::surface
