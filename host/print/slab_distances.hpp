#pragma once
/// Signed distances to a closed mesh on slices of a grid, and unions of balls on the same points.

#include <Eigen/Core>
#include <limits>
#include <stop_token>
#include <vector>

#include "lattice/grid.hpp"
#include "qjulia/base/progress.hpp"
#include "qjulia/mesh/mesh.hpp"

namespace qjulia::surface {

/// Values at some slices of a grid, x fastest. Lengths are in steps.
struct SlabField {
  Eigen::Vector3i points = Eigen::Vector3i::Zero();
  std::vector<float> values;

  SlabField() = default;
  SlabField(const Eigen::Vector3i& size, float value)
      : points(size), values(size.cast<std::size_t>().prod(), value) {}
};

/// Calls `visit(number, index)` for all points. @throws Interrupted
template <class Visit>
void for_each_point(const SlabField& field, const std::stop_token& stop, const Visit& visit) {
  constexpr std::size_t kPolled = std::size_t{1} << 20;
  for_points(field.points, [&](std::size_t number, const Eigen::Vector3i& index) {
    if (number % kPolled == 0) throw_if_stopped(stop);
    visit(number, index);
  });
}

/// Marks an unknown distance.
constexpr float kFarAway = 1e6F;

/// The largest known distance, in steps. The ends of an edge that the surface crosses are never
/// farther away.
constexpr float kNearReach = 1.001F;

/// A closed mesh in a grid's coordinates.
class MeshInGrid {
 public:
  MeshInGrid(const TriangleMesh& mesh, const Grid& grid);

  /// Distances at `count` slices from slice `first` on, negative inside: exact to single precision
  /// up to kNearReach, and ± kFarAway elsewhere. The side is that of the winding number along x.
  SlabField distances(int first, int count, const std::stop_token& stop) const;

 private:
  const TriangleMesh& mesh_;
  Eigen::Vector3i points_;
  std::vector<Eigen::Vector3d> vertices_;  ///< in steps, from the grid's first point on
};

/// Whether depths know grooves that lie between the points of the grid.
enum class Grooves { wide, all };

/// How deep points lie in the solid, which is the negative distance: exact up to `deepest` steps,
/// and kFarAway beyond. Outside it is less than 0. Below grooves between the points it is too
/// large, by at most a fifth of a step with Grooves::all, which takes twice as long.
/// @param near the solid's, as `MeshInGrid::distances`.
SlabField depths(const SlabField& near, float deepest, Grooves grooves,
                 const std::stop_token& stop);

/// Lowers values within `reach` of a point to the distance from a ball about it: |x − center| −
/// radius.
void add_ball(SlabField& field, const Eigen::Vector3i& center, float radius, float reach);

}  // namespace qjulia::surface
