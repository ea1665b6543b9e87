#pragma once
/// Meshes made ready for printers: their size, the least thickness of walls, a flat foot, a cavity.

#include <cstddef>
#include <optional>

#include "qjulia/figures.hpp"
#include "qjulia/mesh.hpp"
#include "qjulia/progress.hpp"
#include "qjulia/up_axis.hpp"

namespace qjulia {

/// Lengths are in the units of the result; for printers, millimetres.
struct PrintOptions {
  UpAxis up = UpAxis::z;              ///< of the mesh
  std::optional<double> height{};     ///< of the result along the up axis
  std::optional<double> longest{};    ///< the longest side of its box; height and longest exclude
                                      ///< each other, and without both the mesh keeps its size
  std::optional<double> min_wall{};   ///< what the result's `WallThickness::thinnest` is at least
  std::optional<double> flat_foot{};  ///< so much is cut off at the lower end, flat
  std::optional<double> shell{};      ///< thickness of the wall about a cavity
  /// Diameter of the hole that leads from the cavity's lowest place straight down; 0 makes none.
  double drain = 3;
  std::optional<std::size_t> max_triangles{};  ///< as `DecimateOptions`
  std::optional<double> max_error{};
  bool keep_loose = false;  ///< else parts below a hundredth of the largest are left out again

  void validate() const;  ///< @throws OptionError, InputError
  /// Whether anything is asked for.
  bool is_any() const;
};

struct PrintReport {
  double scale = 1;           ///< of the mesh's coordinates, about their origin
  double volume = 0;          ///< of the mesh at that scale, before anything else was done to it
  double printed_volume = 0;  ///< of the result
  /// The thinnest walls before and after, where `min_wall` was asked for.
  double thinnest_before = 0, thinnest = 0;
  double cavity = 0;  ///< the cavity's volume, as far as its cells tell
  LoosePieces loose;  ///< that came off on the way, and were left out
};

struct PrintMesh {
  TriangleMesh mesh;  ///< with normals
  PrintReport report;
};

/// A mesh made ready, in this order: scaled; cut flat at its foot and thickened where its walls are
/// thinner than `min_wall`; hollowed out; decimated; and scaled again by next to nothing, so that
/// it has the size asked for to the last bit of single precision.
///
/// Thickening is local. Balls of half the least wall, in all places in which they fit, keep the
/// surface as it is, but that they round edges and take off what stands out by less than a fifth of
/// the wall. What stands out farther is thin: balls are put about its middle, too, so that walls
/// and thorns grow around it. Half the wall is enlarged until the walls that `wall_thickness` finds
/// are thick enough. All three make a new mesh of signed distances on a grid, by marching cubes, so
/// that it is closed and 2-manifold.
///
/// Memory is that of a few meshes and of one slab of the grid.
/// @param mesh closed and manifold, oriented outward.
/// @throws InputError naming the option, when the mesh is open, or where a length does not fit the
///   mesh: a foot that leaves nothing, a shell without a cavity, a wall of too many cells; Error
///   when walls stay thinner than `min_wall`; Interrupted.
PrintMesh made_printable(TriangleMesh mesh, const PrintOptions& options,
                         const ProgressMonitor& monitor = {});

}  // namespace qjulia
