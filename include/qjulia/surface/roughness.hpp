#pragma once
/// How rough a set is: its area against the cells it is seen with, its porosity and its dimension.

#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "qjulia/base/progress.hpp"
#include "qjulia/device/device.hpp"
#include "qjulia/map/map.hpp"
#include "qjulia/surface/figures.hpp"

namespace qjulia {

/// The outline of a body is what no empty ball of radius `radius` reaches: the body with its
/// grooves, pores and cavities filled where such a ball does not fit in. Lengths are the mesh's.
struct Porosity {
  double radius = 0;          ///< a twentieth of the longest side
  double outline_volume = 0;  ///< counted over cells
  double share = 0;           ///< of the outline that the body does not fill, 0 … 1
};

/// The porosity of a mesh, counted over `resolution` cells along its longest side, 16 … 512.
/// @throws InputError when the mesh has no inside at this resolution, OptionError naming
///   `resolution`, Interrupted.
Porosity porosity(const Device& device, const TriangleMesh& mesh, int resolution = 128,
                  const std::stop_token& stop = {});

/// A surface made with cells of one size; of a set, without loose pieces.
struct SurfaceAtScale {
  int resolution = 0;  ///< cells along the box's longest side
  SurfaceFigures figures;
};

struct RoughnessOptions {
  int resolution = 256;   ///< cells of the finest surface along its box's longest side, 32 … 2048
  int iterations = 6;     ///< n
  void validate() const;  ///< @throws OptionError
};

struct Roughness {
  /// Coarsest first, each of twice as many cells as the one before.
  std::vector<SurfaceAtScale> scales;
  /// The slope s of ln area over ln cells: the area is twice as large for cells 2^(1/s) times as
  /// small. 0 of a smooth body.
  double area_slope = 0;
  SurfaceFigures smooth;  ///< of the surface at n = 1, with the finest cells
  Porosity porosity;      ///< of the finest surface
};

/// Surfaces with `resolution`, a half, a quarter and an eighth of it, down to 16 cells.
/// @throws InputError naming the option, or what is wrong with the map; when there is no surface;
///   Interrupted.
Roughness roughness(const Device& device, const Map& map, const RoughnessOptions& options,
                    const ProgressMonitor& monitor = {});

/// Figures of the map's surface with these cells, loose pieces left out.
/// @throws InputError, Interrupted.
SurfaceFigures figures_of_set(const Device& device, const Map& map, const RoughnessOptions& options,
                              const ProgressMonitor& monitor = {});

/// A mesh's area against the cells it is seen with.
struct MeshScales {
  /// Coarsest first, each of twice as many cells as the one before.
  std::vector<SurfaceAtScale> scales;
  double area_slope = 0;  ///< as `Roughness` has it
  SurfaceFigures whole;   ///< of the mesh itself
};

/// `cell_mesh` with `resolution` cells, a half, a quarter and an eighth of them, down to 16.
/// @param resolution 32 … 1024.
/// @throws InputError as `cell_mesh`, OptionError naming `resolution`, Interrupted.
MeshScales mesh_scales(const Device& device, const TriangleMesh& mesh, int resolution = 256,
                       const ProgressMonitor& monitor = {});

nlohmann::json to_json(const MeshScales& scales);
nlohmann::json to_json(const Porosity& porosity);
/// Undefined figures are null.
nlohmann::json to_json(const Roughness& roughness);

}  // namespace qjulia
