#include "mesh/point_cells.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <nanoflann.hpp>
#include <numbers>
#include <vector>

#include "qjulia/base/progress.hpp"

namespace qjulia::shape {
namespace {

constexpr std::size_t kNeighbours = 32;
constexpr std::size_t kPointsPolled = std::size_t{1} << 12;
/// Normals with a larger cosine belong to the same side of a surface.
constexpr double kSameSide = 0.5;
/// Those with a smaller one belong to the other side of a thin body.
constexpr double kOtherSide = -0.3;

/// Points as nanoflann wants them.
struct PointList {
  std::span<const Eigen::Vector3d> points;

  std::size_t kdtree_get_point_count() const { return points.size(); }
  double kdtree_get_pt(std::size_t i, std::size_t axis) const {
    return points[i][static_cast<Eigen::Index>(axis)];
  }
  template <class Bounds>
  bool kdtree_get_bbox(Bounds&) const {
    return false;
  }
};
using PointTree =
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, PointList>, PointList,
                                        3, std::uint32_t>;

/// A convex polygon about the origin of a plane, counter-clockwise.
using Cell = std::vector<Eigen::Vector2d>;

/// What of the cell lies where x · across <= limit (Sutherland and Hodgman 1974).
void cut_cell(Cell& cell, const Eigen::Vector2d& across, double limit, Cell& rest) {
  rest.clear();
  for (std::size_t i = 0; i < cell.size(); ++i) {
    const Eigen::Vector2d& a = cell[i];
    const Eigen::Vector2d& b = cell[(i + 1) % cell.size()];
    const double beyond_a = a.dot(across) - limit, beyond_b = b.dot(across) - limit;
    if (beyond_a <= 0) rest.push_back(a);
    if ((beyond_a < 0 && beyond_b > 0) || (beyond_a > 0 && beyond_b < 0)) {
      rest.emplace_back(a + (b - a) * (beyond_a / (beyond_a - beyond_b)));
    }
  }
  std::swap(cell, rest);
}

class Cells {
 public:
  Cells(std::span<const Eigen::Vector3d> points, std::span<const Eigen::Vector3d> normals,
        const std::stop_token& stop)
      : points_(points),
        normals_(normals),
        stop_(stop),
        neighbours_(std::min(kNeighbours, points.size() - 1)) {
    find_neighbours();
  }

  TriangleMesh mesh() const {
    TriangleMesh mesh;
    Cell cell, spare;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      if (i % kPointsPolled == 0) throw_if_stopped(stop_);
      add_cell(i, mesh, cell, spare);
    }
    return mesh;
  }

 private:
  void find_neighbours() {
    const PointList list{points_};
    const PointTree tree(3, list);
    near_.resize(points_.size() * neighbours_);
    reach_.resize(points_.size());
    std::array<std::uint32_t, kNeighbours + 1> found;
    std::array<double, kNeighbours + 1> squares;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      if (i % kPointsPolled == 0) throw_if_stopped(stop_);
      const std::size_t count =
          tree.knnSearch(points_[i].data(), neighbours_ + 1, found.data(), squares.data());
      std::uint32_t* next = near_.data() + i * neighbours_;
      for (std::size_t k = 0, kept = 0; k < count && kept < neighbours_; ++k) {
        if (found[k] == i) continue;
        *next++ = found[k];
        ++kept;
      }
      reach_[i] = std::sqrt(squares[count - 1]);
    }
  }

  std::span<const std::uint32_t> near(std::size_t i) const {
    return std::span(near_).subspan(i * neighbours_, neighbours_);
  }

  /// How far a cell may reach: as far as all points are known that could bound it, and for a point
  /// that is alone, no farther than those of its neighbours.
  double radius(std::size_t i) const {
    std::vector<double> reaches;
    for (const std::uint32_t j : near(i)) reaches.push_back(reach_[j]);
    const auto middle = reaches.begin() + static_cast<std::ptrdiff_t>(reaches.size() / 2);
    std::ranges::nth_element(reaches, middle);
    return std::min(reach_[i] / 2, *middle);
  }

  void add_cell(std::size_t i, TriangleMesh& mesh, Cell& cell, Cell& spare) const {
    const Eigen::Vector3d& normal = normals_[i];
    const Eigen::Vector3d u = normal.unitOrthogonal();
    const Eigen::Vector3d v = normal.cross(u);
    constexpr int kCorners = 8;
    const double outer = radius(i);
    cell.clear();
    for (int corner = 0; corner < kCorners; ++corner) {
      const double angle = 2 * std::numbers::pi * corner / kCorners;
      cell.emplace_back(outer * Eigen::Vector2d(std::cos(angle), std::sin(angle)));
    }
    for (const std::uint32_t j : near(i)) {
      const double cosine = normal.dot(normals_[j]);
      if (cosine < kOtherSide) continue;
      const auto in_plane = [&](const Eigen::Vector3d& x) {
        return Eigen::Vector2d(x.dot(u), x.dot(v));
      };
      const Eigen::Vector3d to_neighbour = points_[j] - points_[i];
      if (cosine > kSameSide) {
        const Eigen::Vector2d across = in_plane(to_neighbour);
        cut_cell(cell, across, across.squaredNorm() / 2, spare);
      } else {
        // The neighbour's plane, of which this point's side stays.
        const double beyond = normals_[j].dot(to_neighbour);
        cut_cell(cell, in_plane(beyond < 0 ? -normals_[j] : normals_[j]), std::abs(beyond), spare);
      }
    }
    if (cell.size() < 3) return;
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (const Eigen::Vector2d& x : cell) {
      mesh.vertices.emplace_back(points_[i] + x.x() * u + x.y() * v);
    }
    for (std::uint32_t k = 2; k < cell.size(); ++k) {
      mesh.triangles.push_back({first, first + k - 1, first + k});
    }
  }

  std::span<const Eigen::Vector3d> points_, normals_;
  const std::stop_token& stop_;
  std::size_t neighbours_;
  std::vector<std::uint32_t> near_;  ///< `neighbours_` for each point, nearest first
  std::vector<double> reach_;        ///< how far the last of them is
};

}  // namespace

TriangleMesh point_cells(std::span<const Eigen::Vector3d> points,
                         std::span<const Eigen::Vector3d> normals, const std::stop_token& stop) {
  if (points.size() < 2) return {};
  return Cells(points, normals, stop).mesh();
}

}  // namespace qjulia::shape
