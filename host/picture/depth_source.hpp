#pragma once
/// What can be seen: anything that knows the depths of a view.

#include <memory>
#include <vector>

#include "picture/view.hpp"
#include "qjulia/device.hpp"
#include "qjulia/mesh.hpp"
#include "qjulia/rational_map.hpp"

namespace qjulia {

class DepthSource {
 public:
  virtual ~DepthSource() = default;

  /// Depths of `rows` rows of the view from `first_row` on, row by row; QJ_NO_HIT where a ray
  /// meets nothing.
  virtual std::vector<float> depths(const View& view, int first_row, int rows) = 0;

  /// A box that holds the shape, in the view's coordinates.
  virtual Box bounds() const = 0;
};

/// The iterated set of a map, in map coordinates, ray-marched on the device.
std::unique_ptr<DepthSource> march_source(const Device& device, const RationalMap& map,
                                          int iterations);

/// A mesh, in its own coordinates, rasterised on the host. `mesh` must outlive the source.
std::unique_ptr<DepthSource> mesh_source(const TriangleMesh& mesh);

}  // namespace qjulia
