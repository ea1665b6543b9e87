#pragma once
/// F_n at the points of a regular grid, block by block.

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <vector>

#include "device/context.hpp"
#include "qjulia/field.hpp"

namespace qjulia {

/// Point (i, j, k) lies at origin + step (i, j, k), map coordinates.
struct Grid {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  double step = 1;
  std::array<int, 3> points{0, 0, 0};

  Eigen::Vector3d at(const Eigen::Vector3d& index) const { return origin + step * index; }
};

/// The points first … first + count − 1 of a grid along each axis. Fewer than 2³¹ of them.
struct GridBlock {
  std::array<int, 3> first{0, 0, 0};
  std::array<int, 3> count{0, 0, 0};

  std::size_t size() const;
};

/// The grid's slices `z` … `z + count − 1`.
GridBlock slices(const Grid& grid, int z, int count);

/// Slices to ask for at a time: about a million points, bounded memory and launches worth making.
int slices_at_once(const Grid& grid);

/// F_n with orbits ended at the stop radii, in single precision. The values are those of
/// `Field::decided_at`, bit for bit: one iterate everywhere, and the rest only at the points that
/// it leaves undecided (a few per cent of the domain, gathered so that no lane is idle).
class LevelSet {
 public:
  LevelSet(const Device& device, const RationalMap& map, const StopRadii& stops, int iterations);

  /// One value a point, x fastest, then y. Launches are kept near 100 ms.
  std::vector<float> over(const Grid& grid, const GridBlock& block) const;

 private:
  void first_iterate(const Grid& grid, const GridBlock& block, std::vector<float>& values) const;
  void iterate(const Grid& grid, const GridBlock& block, const std::vector<std::int32_t>& points,
               std::vector<float>& values) const;
  bool undecided(float value) const { return value > below_ && value < above_; }
  std::size_t lanes() const;
  std::size_t groups_per_launch(int iterations) const;

  Device device_;
  int factors_;
  int iterations_;
  device::RealBuffer map_;
  float below_;  ///< an iterate of this log radius or less never leaves
  float above_;  ///< an iterate of this log radius or more never returns
};

}  // namespace qjulia
