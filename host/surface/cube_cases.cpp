#include "surface/cube_cases.hpp"

#include <algorithm>
#include <optional>
#include <utility>

namespace qjulia::surface {
namespace {

std::array<CubeEdge, 12> make_edges() {
  std::array<CubeEdge, 12> edges{};
  std::size_t next = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const int u = axis == 0 ? 1 : 0, v = axis == 2 ? 1 : 2;
    for (int b = 0; b < 4; ++b) {
      const int low = (b & 1) << u | (b >> 1) << v;
      edges[next++] = {axis, low, low | 1 << axis};
    }
  }
  return edges;
}

std::uint8_t edge_between(int p, int q) {
  const auto& edges = cube_edges();
  const auto found = std::ranges::find_if(edges, [&](const CubeEdge& edge) {
    return edge.low == std::min(p, q) && edge.high == std::max(p, q);
  });
  return static_cast<std::uint8_t>(found - edges.begin());
}

/// Corners of a face in counter-clockwise order seen from outside the cell.
std::array<int, 4> face_corners(int face) {
  const int axis = face / 2;
  const int side = face % 2;
  const int u = 1 << (axis + 1) % 3;
  const int v = 1 << (axis + 2) % 3;
  const int base = side << axis;
  if (side == 1) return {base, base | u, base | u | v, base | v};
  return {base, base | v, base | u | v, base | u};
}

bool on_face(int edge, int face) {
  const CubeEdge& e = cube_edges()[static_cast<std::size_t>(edge)];
  const int axis = face / 2;
  return (e.low >> axis & 1) == face % 2 && (e.high >> axis & 1) == face % 2;
}

bool share_a_face(int edge, int other) {
  for (int face = 0; face < 6; ++face) {
    if (on_face(edge, face) && on_face(other, face)) return true;
  }
  return false;
}

using Triangles = std::vector<std::uint8_t>;

/// Cuts the vertices first … last of a loop, closed by the chord (last, first), without inner
/// chords that lie on a face; nothing when there is no such way.
std::optional<Triangles> cut(const std::vector<std::uint8_t>& loop, std::size_t first,
                             std::size_t last) {
  if (last - first < 2) return Triangles{};
  const auto allowed = [&](std::size_t i, std::size_t j) {
    return j - i == 1 || !share_a_face(loop[i], loop[j]);
  };
  for (std::size_t apex = first + 1; apex < last; ++apex) {
    if (!allowed(first, apex) || !allowed(apex, last)) continue;
    auto before = cut(loop, first, apex);
    const auto after = cut(loop, apex, last);
    if (!before || !after) continue;
    before->insert(before->end(), {loop[first], loop[apex], loop[last]});
    before->insert(before->end(), after->begin(), after->end());
    return before;
  }
  return std::nullopt;
}

std::vector<CubeLoop> make_case(unsigned inside) {
  // Each crossed edge begins one segment and ends one, on its two faces.
  std::array<int, 12> next;
  next.fill(-1);
  for (int face = 0; face < 6; ++face) {
    for (const auto& [from, to] : face_segments(inside, face)) next[from] = to;
  }
  std::vector<CubeLoop> loops;
  for (std::uint8_t start = 0; start < 12; ++start) {
    if (next[start] < 0) continue;
    CubeLoop loop;
    std::uint8_t edge = start;
    while (next[edge] >= 0) {
      loop.edges.push_back(edge);
      edge = static_cast<std::uint8_t>(std::exchange(next[edge], -1));
    }
    loop.triangles =
        cut(loop.edges, 0, loop.edges.size() - 1).value();  // there is a way in every case
    loops.push_back(std::move(loop));
  }
  return loops;
}

}  // namespace

const std::array<CubeEdge, 12>& cube_edges() {
  static const std::array<CubeEdge, 12> edges = make_edges();
  return edges;
}

std::vector<std::array<std::uint8_t, 2>> face_segments(unsigned inside, int face) {
  const auto corners = face_corners(face);
  const auto is_inside = [&](std::size_t i) { return (inside >> corners[i % 4] & 1U) != 0; };
  std::vector<std::array<std::uint8_t, 2>> segments;
  for (std::size_t i = 0; i < 4; ++i) {
    if (is_inside(i) || !is_inside(i + 1)) continue;
    // A run of inside corners begins at i + 1: cut it off from where it is entered to where it is
    // left.
    std::size_t last = i + 1;
    while (is_inside(last + 1)) ++last;
    segments.push_back({edge_between(corners[i], corners[(i + 1) % 4]),
                        edge_between(corners[last % 4], corners[(last + 1) % 4])});
  }
  return segments;
}

const std::array<std::vector<CubeLoop>, 256>& cube_cases() {
  static const auto cases = [] {
    std::array<std::vector<CubeLoop>, 256> all;
    for (unsigned inside = 0; inside < 256; ++inside) all[inside] = make_case(inside);
    return all;
  }();
  return cases;
}

}  // namespace qjulia::surface
