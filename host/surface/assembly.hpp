#pragma once
/// From the parts that marching cubes makes to vertices with places and normals.

#include <Eigen/Core>
#include <span>
#include <vector>

#include "qjulia/surface.hpp"
#include "surface/marching_cubes.hpp"

namespace qjulia {

/// Hands parts on to a sink. Keeps those vertices only that further triangles can still use.
class Assembly {
 public:
  Assembly(const Grid& grid, const ShapeToMap& shape_to_map, SurfaceSink& sink)
      : grid_(grid), shape_to_map_(shape_to_map), sink_(sink) {}

  void add(const MeshPart& part);

  std::size_t vertices() const { return first_ + positions_.size(); }
  std::size_t triangles() const { return triangles_; }

 private:
  Eigen::Vector3d& position(std::uint32_t number) { return positions_[number - first_]; }
  void place(const MeshPart& part);
  void add_normals(const std::vector<Triangle>& triangles);

  Grid grid_;
  ShapeToMap shape_to_map_;
  SurfaceSink& sink_;
  std::uint32_t first_ = 0;                 ///< number of the first vertex kept
  std::vector<Eigen::Vector3d> positions_;  ///< shape units
  std::vector<Eigen::Vector3d> normals_;    ///< sums of triangles' area vectors, twice
  std::size_t triangles_ = 0;
};

}  // namespace qjulia
