#pragma once
/// What a material shows at points of a map's set, for the colours of meshes and textures.

#include <Eigen/Core>
#include <span>
#include <stop_token>
#include <vector>

#include "map/device_map.hpp"
#include "picture/material_traits.hpp"
#include "qjulia/picture/surface_colors.hpp"

namespace qjulia::picture {

class PointTraits {
 public:
  /// @param options `validate` has passed them. @param stop ends the orbits: Interrupted
  PointTraits(const Device& device, const Map& map, const SurfaceColorOptions& options,
              std::stop_token stop);

  /// One number for each point, shape units, which stands for a ball of its diameter, map units.
  std::vector<float> operator()(std::span<const Eigen::Vector3d> points,
                                std::span<const double> widths) const;

 private:
  Coloring coloring_;
  map::DeviceMap map_;
  int iterations_;
  std::stop_token stop_;
};

/// The palette's colour of a trait.
VertexColor vertex_color(const Palette& palette, const MaterialRange& range, float trait);

}  // namespace qjulia::picture
