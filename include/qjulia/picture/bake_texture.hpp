#pragma once
/// A texture that shows a fine mesh, and its map's colours, on a mesh of fewer triangles.

#include <optional>

#include "qjulia/base/progress.hpp"
#include "qjulia/device/device.hpp"
#include "qjulia/map/map.hpp"
#include "qjulia/mesh/texture.hpp"
#include "qjulia/picture/surface_colors.hpp"

namespace qjulia {

struct TextureOptions {
  static constexpr int kLeastSize = 64, kMostSize = 8192;
  int size = 2048;  ///< pixels of each side of the texture
  /// The colours. None: only normals are baked.
  std::optional<SurfaceColorOptions> colors{};
  void validate() const;  ///< @throws OptionError
};

/// Each two triangles have a square of the texture, with a margin of more than a pixel about each
/// triangle that shows what lies beyond its edges, so that no seams are seen. A pixel shows the
/// point of the fine mesh that is nearest to the pixel's place on the coarse one: that point's
/// normal, interpolated between the fine mesh's vertices, in the tangent space of the coarse
/// triangle (MikkTSpace's), and the colour that `surface_colors` gives it for a ball as wide as the
/// pixel.
/// @param fine, coarse of the map's set, shape units, with normals.
/// @throws OptionError naming `size` where the squares would have fewer than 8 pixels a side;
///   InputError for a mesh without triangles or normals; Interrupted
MeshTexture bake_texture(const Device& device, const Map& map, const TriangleMesh& fine,
                         const TriangleMesh& coarse, const TextureOptions& options,
                         const ProgressMonitor& monitor = {});

}  // namespace qjulia
