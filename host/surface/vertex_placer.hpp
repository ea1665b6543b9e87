#pragma once
/// Puts a mesh's vertices where the set ends, by trying points between grid points.

#include <span>

#include "map/device_map.hpp"
#include "qjulia/map/field.hpp"
#include "surface/edge_vertex.hpp"

namespace qjulia::surface {

class VertexPlacer {
 public:
  /// @param iterations n. @param tries the most points tried on each edge, 1 or more.
  VertexPlacer(const Device& device, const Map& map, const StopRadii& stops, int iterations,
               Precision precision, const DifferenceScale& scale, int tries);

  /// Tries points on each vertex's edge. Each shows on which side of it the set ends, and about how
  /// far away (kernels/place_vertices.cl). Where a vertex is put does not depend on the others.
  void place(const Grid& grid, std::span<EdgeVertex> vertices) const;

 private:
  map::DeviceMap map_;
  int iterations_;
  DifferenceScale scale_;
  int tries_;
  bool is_counted_;  ///< whether the kernel counts its turns
  device::Kernel kernel_;
  double slope_;    ///< |∇F_1| about the surface, map units; 0 if it is not known
  double stretch_;  ///< factor by which an iterate stretches distances
};

}  // namespace qjulia::surface
