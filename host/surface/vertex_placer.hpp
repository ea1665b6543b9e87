#pragma once
/// Puts a mesh's vertices where the set ends, by the sides of points between grid points.

#include <span>

#include "map/device_map.hpp"
#include "qjulia/field.hpp"
#include "surface/edge_vertex.hpp"

namespace qjulia::surface {

class VertexPlacer {
 public:
  /// @param iterations n. @param tries on each edge at most, 1 or more.
  VertexPlacer(const Device& device, const RationalMap& map, const StopRadii& stops, int iterations,
               Precision precision, const DifferenceScale& scale, int tries);

  /// Tries places on each vertex's edge, each of which tells on which side of it the set ends and
  /// about how far from it (kernels/place_vertices.cl). Where a vertex comes to lie does not depend
  /// on the others.
  void place(const Grid& grid, std::span<EdgeVertex> vertices) const;

 private:
  map::DeviceMap map_;
  int iterations_;
  DifferenceScale scale_;
  int tries_;
  double slope_;    ///< |∇F_1| about the surface, map units; 0 where it is not known
  double stretch_;  ///< of distances by an iterate
};

}  // namespace qjulia::surface
