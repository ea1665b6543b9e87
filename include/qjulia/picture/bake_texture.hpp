#pragma once
/// A texture that shows a fine mesh, and its map's colours, on a mesh of fewer triangles.

#include <cstddef>
#include <optional>

#include "qjulia/base/progress.hpp"
#include "qjulia/device/device.hpp"
#include "qjulia/map/map.hpp"
#include "qjulia/mesh/texture.hpp"
#include "qjulia/picture/surface_colors.hpp"

namespace qjulia {

/// How a texture is baked.
struct TextureOptions {
  static constexpr int kLeastSize = 64, kMostSize = 8192;
  int size = 2048;  ///< pixels along each side, 64 … 8192
  /// The colours; their range is by default that of the fine mesh. None: only normals are baked.
  std::optional<SurfaceColorOptions> colors{};
  void validate() const;  ///< @throws OptionError
};

/// Every two triangles need a square of 8 × 8 pixels.
/// @throws OptionError naming `size` where a texture of so many pixels a side has too few of them
void expect_texture_size(int size, std::size_t triangles);

/// Normals of a fine mesh, and the colours of its map, for a coarse mesh. Every two triangles share
/// a square of the texture, with a margin of more than a pixel about each triangle that shows what
/// lies beyond its edges, so that seams do not show. A pixel shows the point of the fine mesh that
/// is nearest to the pixel's place on the coarse one: that point's normal, interpolated between the
/// fine mesh's vertices, in the tangent space of the coarse triangle (MikkTSpace's), and the colour
/// that `surface_colors` gives it for a ball as wide as the pixel.
/// @param fine, coarse of the map's set, shape units, with normals of length 1.
/// @return places, tangents and pictures of `options.size`² pixels
/// @throws OptionError naming `size` as `expect_texture_size`, or an option of `colors`; InputError
///   for an invalid map, or a mesh without triangles or normals; Interrupted
MeshTexture bake_texture(const Device& device, const Map& map, const TriangleMesh& fine,
                         const TriangleMesh& coarse, const TextureOptions& options,
                         const ProgressMonitor& monitor = {});

}  // namespace qjulia
