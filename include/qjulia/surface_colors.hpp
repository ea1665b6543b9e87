#pragma once
/// Colours of a surface's vertices, by the orbits of points just inside it.

#include <optional>
#include <vector>

#include "qjulia/colors.hpp"
#include "qjulia/device.hpp"
#include "qjulia/map.hpp"
#include "qjulia/mesh.hpp"
#include "qjulia/picture.hpp"
#include "qjulia/progress.hpp"

namespace qjulia {

struct SurfaceColorOptions {
  Material material = Material::iterations;  ///< iterations or trap
  Palette palette{};
  int iterations = 6;  ///< as the surface was extracted
  /// Radius beyond which orbits end, map units; by default where none returns from.
  std::optional<double> escape = std::nullopt;
  Precision precision = Precision::single;  ///< arithmetic of the orbits
  void validate() const;                    ///< @throws OptionError
};

struct SurfaceColors {
  std::vector<VertexColor> colors;  ///< one for each vertex
  /// What the material shows, 0 … 1, where the palette begins and ends.
  double low = 0, high = 1;
};

/// What a material shows is taken at three points of each triangle, a quarter of the mesh's mean
/// edge behind it: on the surface itself orbits part, and neighbours have nothing in common. A
/// vertex gets the mean over the triangles around it, weighted by their areas; one without
/// triangles gets the palette's first colour. The palette is spread over what occurs: it begins at
/// the 2nd percentile of the vertices and ends at the 98th. Where both are the same, it spans 0 … 1
/// as in pictures. The cost is that of three orbits a triangle.
/// @param mesh of the map's set, shape units.
/// @throws InputError naming the option or what is wrong with the map or the mesh; Interrupted.
SurfaceColors surface_colors(const Device& device, const Map& map, const TriangleMesh& mesh,
                             const SurfaceColorOptions& options,
                             const ProgressMonitor& monitor = {});

}  // namespace qjulia
