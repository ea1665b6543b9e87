#pragma once
/// What several checks compute: so small that a reference on the host has it at once.

#include <vector>

#include "lattice/grid.hpp"
#include "profile/workload.hpp"

namespace qjulia::check {

constexpr int kIterations = 4;

/// 300 samples and 24 factors: no number is a multiple of a group.
profiling::Workload small_work();

/// Cell centres of [−1.5, 1.5]³, x fastest.
surface::Grid small_grid();
std::vector<Quaternion> grid_points(const surface::Grid& grid, double slice);

}  // namespace qjulia::check
