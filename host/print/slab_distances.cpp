#include "print/slab_distances.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "mesh/flat_triangle.hpp"

namespace qjulia::surface {
namespace {

/// Marks where lines along x enter (+1) and leave (−1) the mesh.
class Crossings {
 public:
  Crossings(const Eigen::Vector3i& points, const std::vector<Eigen::Vector3d>& vertices, int first)
      : points_(points),
        vertices_(vertices),
        first_(first),
        turns_(points.cast<std::size_t>().prod()) {}

  void add(const Triangle& triangle, const Eigen::AlignedBox3d& box) {
    const int y0 = std::max(0, static_cast<int>(std::ceil(box.min().y())));
    const int y1 = std::min(points_.y() - 1, static_cast<int>(std::floor(box.max().y())));
    const int z0 = std::max(0, static_cast<int>(std::ceil(box.min().z())) - first_);
    const int z1 = std::min(points_.z() - 1, static_cast<int>(std::floor(box.max().z())) - first_);
    for (int z = z0; z <= z1; ++z) {
      for (int y = y0; y <= y1; ++y) add(triangle, y, z);
    }
  }

  /// Winding numbers, in the order of the points.
  std::vector<std::int16_t> windings() && {
    const auto nx = static_cast<std::size_t>(points_.x());
    for (std::size_t i = 0; i < turns_.size(); ++i) {
      if (i % nx != 0) turns_[i] = static_cast<std::int16_t>(turns_[i] + turns_[i - 1]);
    }
    return std::move(turns_);
  }

 private:
  /// Whether the line is left of the edge, seen along x. Triangles that share the edge get opposite
  /// answers, so that a line passes through exactly one of them.
  bool is_left(std::uint32_t from, std::uint32_t to, double y, double z) const {
    const bool turned = from > to;
    const Eigen::Vector3d& a = vertices_[turned ? to : from];
    const Eigen::Vector3d& b = vertices_[turned ? from : to];
    const double side = (b.y() - a.y()) * (z - a.z()) - (b.z() - a.z()) * (y - a.y());
    return (side > 0) != turned;
  }

  void add(const Triangle& triangle, int y, int z) {
    const auto& [a, b, c] = triangle;
    const double line_y = y, line_z = z + first_;
    const bool left = is_left(a, b, line_y, line_z);
    if (is_left(b, c, line_y, line_z) != left || is_left(c, a, line_y, line_z) != left) return;
    const Eigen::Vector3d& p = vertices_[a];
    const Eigen::Vector3d normal = (vertices_[b] - p).cross(vertices_[c] - p);
    if (normal.x() == 0) return;
    const double x =
        p.x() - (normal.y() * (line_y - p.y()) + normal.z() * (line_z - p.z())) / normal.x();
    const int next = std::max(0, static_cast<int>(std::ceil(x)));
    if (next >= points_.x()) return;
    const std::size_t number = number_of({next, y, z}, points_);
    turns_[number] = static_cast<std::int16_t>(turns_[number] + (left ? -1 : 1));
  }

  Eigen::Vector3i points_;
  const std::vector<Eigen::Vector3d>& vertices_;
  int first_;  ///< slice
  std::vector<std::int16_t> turns_;
};

/// Lowers values near a triangle to its distance.
void lower_near(SlabField& field, const double* triangle, const Eigen::AlignedBox3d& box,
                int first) {
  const Eigen::Vector3i shift(0, 0, first);
  const Eigen::Vector3i low =
      ((box.min().array() - kNearReach).ceil().cast<int>().matrix() - shift).cwiseMax(0);
  const Eigen::Vector3i high =
      ((box.max().array() + kNearReach).floor().cast<int>().matrix() - shift)
          .cwiseMin(field.points - Eigen::Vector3i::Ones());
  const Eigen::Vector3d normal = shape::vector_at(triangle + QJ_TRIANGLE_NORMAL);
  const Eigen::Vector3d corner = shape::vector_at(triangle + QJ_TRIANGLE_A);
  for (int z = low.z(); z <= high.z(); ++z) {
    for (int y = low.y(); y <= high.y(); ++y) {
      float* row = field.values.data() + number_of({0, y, z}, field.points);
      for (int x = low.x(); x <= high.x(); ++x) {
        const Eigen::Vector3d p(x, y, z + first);
        if (std::abs(normal.dot(p - corner)) > kNearReach) continue;
        const auto distance =
            static_cast<float>((shape::nearest_on_triangle(p, triangle) - p).norm());
        if (distance <= kNearReach) row[x] = std::min(row[x], distance);
      }
    }
  }
}

}  // namespace

MeshInGrid::MeshInGrid(const TriangleMesh& mesh, const Grid& grid)
    : mesh_(mesh), points_(grid.points) {
  vertices_.reserve(mesh.vertices.size());
  for (const Eigen::Vector3d& x : mesh.vertices) {
    vertices_.emplace_back((x - grid.origin) / grid.step);
  }
}

SlabField MeshInGrid::distances(int first, int count, const std::stop_token& stop) const {
  constexpr std::size_t kPolled = std::size_t{1} << 14;
  SlabField field({points_.x(), points_.y(), count}, kFarAway);
  Crossings crossings(field.points, vertices_, first);
  std::array<double, QJ_TRIANGLE_REALS> flat{};
  for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
    if (t % kPolled == 0) throw_if_stopped(stop);
    const auto& [a, b, c] = mesh_.triangles[t];
    Eigen::AlignedBox3d box(vertices_[a]);
    box.extend(vertices_[b]).extend(vertices_[c]);
    if (box.max().z() < first - 2 || box.min().z() > first + count + 1) continue;
    shape::flatten(vertices_[a], vertices_[b], vertices_[c], flat.data());
    lower_near(field, flat.data(), box, first);
    crossings.add(mesh_.triangles[t], box);
  }
  const std::vector<std::int16_t> windings = std::move(crossings).windings();
  for (std::size_t i = 0; i < windings.size(); ++i) {
    if (windings[i] > 0) field.values[i] = -field.values[i];
  }
  return field;
}

SlabField depths(const SlabField& near, float deepest, Grooves grooves,
                 const std::stop_token& stop) {
  SlabField depth(near.points, kFarAway);
  std::ranges::transform(near.values, depth.values.begin(), [](float value) { return -value; });
  // The complement is a union of balls, and those about its points near the surface will do. Of a
  // point inside, at a distance d, others are at most d farther from the surface than from it.
  const float least = grooves == Grooves::all ? -kNearReach : 0;
  for_each_point(near, stop, [&](std::size_t number, const Eigen::Vector3i& index) {
    const float outside = near.values[number];
    if (outside >= least && outside <= kNearReach) {
      add_ball(depth, index, outside, deepest + outside);
    }
  });
  return depth;
}

void add_ball(SlabField& field, const Eigen::Vector3i& center, float radius, float reach) {
  const int whole = static_cast<int>(reach);
  const int z0 = std::max(0, center.z() - whole);
  const int z1 = std::min(field.points.z() - 1, center.z() + whole);
  const int y0 = std::max(0, center.y() - whole);
  const int y1 = std::min(field.points.y() - 1, center.y() + whole);
  for (int z = z0; z <= z1; ++z) {
    for (int y = y0; y <= y1; ++y) {
      const auto dy = static_cast<float>(y - center.y()), dz = static_cast<float>(z - center.z());
      const float across = dy * dy + dz * dz;
      const float left = reach * reach - across;
      if (left < 0) continue;
      const int half = static_cast<int>(std::sqrt(left));
      const int x0 = std::max(0, center.x() - half);
      const int x1 = std::min(field.points.x() - 1, center.x() + half);
      float* row = field.values.data() + number_of({0, y, z}, field.points);
      for (int x = x0; x <= x1; ++x) {
        const auto dx = static_cast<float>(x - center.x());
        row[x] = std::min(row[x], std::sqrt(dx * dx + across) - radius);
      }
    }
  }
}

}  // namespace qjulia::surface
