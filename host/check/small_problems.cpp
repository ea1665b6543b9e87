#include "check/small_problems.hpp"

#include "qjulia/map/field.hpp"

namespace qjulia::check {

using Eigen::Vector3d;

profiling::Workload small_work() {
  return profiling::make_workload({.sample_points = 300, .factors = 24});
}

surface::Grid small_grid() {
  constexpr int kSide = 9;
  return {Vector3d::Constant(-1.4), 2.8 / (kSide - 1), {kSide, kSide, kSide}};
}

std::vector<Quaternion> grid_points(const surface::Grid& grid, double slice) {
  std::vector<Vector3d> points;
  surface::for_points(grid.points, [&](std::size_t, const Eigen::Vector3i& index) {
    points.push_back(grid.point(index));
  });
  return on_slice(points, slice);
}

}  // namespace qjulia::check
