#pragma once
/// Colours of a surface's vertices, as pictures of the same map have them.

#include <optional>
#include <vector>

#include "qjulia/base/colors.hpp"
#include "qjulia/base/progress.hpp"
#include "qjulia/device/device.hpp"
#include "qjulia/map/map.hpp"
#include "qjulia/mesh/mesh.hpp"
#include "qjulia/picture/picture.hpp"

namespace qjulia {

struct SurfaceColorOptions {
  Material material = Material::iterations;  ///< all but clay
  Palette palette{};
  int iterations = 6;  ///< as the surface was extracted
  /// Radius beyond which orbits end, map units; by default where none returns from.
  std::optional<double> escape = std::nullopt;
  Precision precision = Precision::single;  ///< arithmetic of the orbits
  /// The values of the material at which the palette begins and ends. By default as in pictures of
  /// the map, by `Studio::range`.
  std::optional<MaterialRange> range = std::nullopt;
  void validate() const;  ///< @throws OptionError
};

struct SurfaceColors {
  std::vector<VertexColor> colors;  ///< one for each vertex
  MaterialRange range{};            ///< the palette's
  /// The share of the edges, from a sample of them, along which colours change by more than a
  /// quarter of the way from black to white in a picture that shows the mesh's diagonal with 600
  /// pixels. Where it is high, the mesh shows dots or a mean colour in place of bands.
  double abrupt_share = 0;
};

/// The colours of pictures of the map, at vertices. As the colour of a pixel is that of a ball as
/// wide as the pixel, the colour of a vertex is that of a ball whose diameter is the mean length of
/// the edges at the vertex. The up axis, for heights, is the map's, else `kDefaultUp`. The cost is
/// that of four orbits a vertex.
/// @param mesh of the map's set, shape units.
/// @throws InputError naming the option or what is wrong with the map or the mesh; Interrupted.
SurfaceColors surface_colors(const Device& device, const Map& map, const TriangleMesh& mesh,
                             const SurfaceColorOptions& options,
                             const ProgressMonitor& monitor = {});

}  // namespace qjulia
