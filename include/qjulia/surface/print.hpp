#pragma once
/// Meshes made ready for printers: their size, the least thickness of walls, a flat foot, a cavity.

#include <cstddef>
#include <optional>

#include "qjulia/base/progress.hpp"
#include "qjulia/base/up_axis.hpp"
#include "qjulia/mesh/decimate.hpp"
#include "qjulia/mesh/mesh.hpp"
#include "qjulia/surface/figures.hpp"

namespace qjulia {

/// Lengths are in the units of the result; for printers, millimetres.
struct PrintOptions {
  UpAxis up = UpAxis::z;              ///< of the mesh
  std::optional<double> height{};     ///< of the result along the up axis
  std::optional<double> longest{};    ///< the longest side of its box; height and longest exclude
                                      ///< each other, and without both the mesh keeps its size
  std::optional<double> min_wall{};   ///< the least `WallThickness::thinnest` of the result
  std::optional<double> flat_foot{};  ///< length that is cut off at the lower end, flat
  std::optional<double> shell{};      ///< thickness of the wall about a cavity
  /// Diameter of the hole that leads from the cavity's lowest place straight down; 0 makes none.
  double drain = 3;
  std::optional<std::size_t> max_triangles{};  ///< as `DecimateOptions`
  std::optional<double> max_error{};
  bool keep_loose = false;  ///< else parts below a hundredth of the largest are left out again

  void validate() const;  ///< @throws OptionError for an option, InputError for a mesh
  /// Whether anything is asked for.
  bool is_any() const;
};

struct PrintReport {
  double scale = 1;           ///< of the mesh's coordinates, about their origin
  double volume = 0;          ///< of the mesh at that scale, before anything else was done to it
  double printed_volume = 0;  ///< of the result
  /// The thinnest walls before and after, where `min_wall` was asked for.
  double thinnest_before = 0, thinnest = 0;
  double cavity = 0;  ///< the cavity's volume, to the accuracy of its cells
  LoosePieces loose;  ///< parts that came off on the way and were left out
  std::optional<DecimationReport> decimation{};  ///< where fewer triangles were asked for
};

struct PrintMesh {
  TriangleMesh mesh;  ///< with normals
  PrintReport report;
};

/// Makes a mesh ready for a printer. In this order, the mesh is scaled; cut flat at its foot and
/// thickened where its walls are thinner than `min_wall`; hollowed out; decimated; and scaled once
/// more by a tiny amount, so that it has the requested size exactly in single precision.
///
/// Thickening is local. The union of all balls of radius `min_wall` / 2 that fit into the mesh is
/// kept; this rounds edges and removes parts that stand out from the union by less than a fifth of
/// the wall. Parts that stand out farther are thin walls and tufts: balls are placed along their
/// middles, too, so that they grow. Cutting, thickening and hollowing make a new mesh by marching
/// cubes from signed distances on a grid, so that it is closed and 2-manifold.
///
/// Thickening changes the size, so the mesh is then scaled to the size that was asked for. If the
/// walls that `wall_thickness` finds are too thin after that, they are thickened again, with balls
/// that are up to a tenth larger. This takes two to four tries, at most six, and progress says
/// which one is under way. The foot is cut in the first try. If the size is off by more than 2 %
/// then, it is cut a second time, at the corrected scale.
///
/// Memory is that of a few meshes and of one slab of the grid.
/// @param mesh closed and manifold, oriented outward.
/// @throws InputError naming the option, when the mesh is open, or where a length does not fit the
///   mesh: a foot that leaves nothing, a shell without a cavity, a wall of too many cells; Error
///   when walls stay thinner than `min_wall`; Interrupted.
PrintMesh made_printable(TriangleMesh mesh, const PrintOptions& options,
                         const ProgressMonitor& monitor = {});

}  // namespace qjulia
