#pragma once
/// A mesh of fewer triangles that keeps its shape.

#include <cstddef>
#include <optional>
#include <stop_token>

#include "qjulia/mesh/mesh.hpp"

namespace qjulia {

/// When to stop: at whichever of the two limits is reached first.
struct DecimateOptions {
  std::optional<std::size_t> most;  ///< the largest number of triangles, 4 or more
  /// The largest distance between mesh and result, units of the mesh.
  std::optional<double> error;
  void validate() const;  ///< @throws OptionError also where neither is given
};

/// Why a decimation ended.
enum class DecimationEnd {
  none,    ///< there was nothing to do: the mesh is small enough
  number,  ///< of triangles
  error,   ///< any further collapse would exceed it
  folds    ///< any further collapse would fold the surface, or leave a sliver
};

struct DecimationReport {
  std::size_t before = 0, after = 0;  ///< triangles
  DecimationEnd end = DecimationEnd::none;
  double farthest = 0;  ///< if an error is given: mesh and result are at most so far apart, where
                        ///< that is measured
};

struct Decimation {
  TriangleMesh mesh;
  DecimationReport report;
};

/// Collapses edges, the least harmful first, until no more than `most` triangles are left. An edge
/// does as little harm as the sum of squared distances of its new vertex to the planes of the
/// triangles that went into it is small (Garland and Heckbert 1997); a collapse that would fold the
/// surface is left out, so that somewhat more triangles may be left. A closed mesh stays closed.
/// Normals of the result are area-weighted means of the triangles around each vertex; none where
/// `mesh` has none. Colours are means, too, of all vertices that went into one. A mesh that is
/// small enough already comes back as it is.
///
/// If an error is given, a collapse that would take a vertex of the mesh too far from the surface
/// is left out. Then distances are measured from 25 points of each triangle of the mesh to the
/// result, and from those of the result to the mesh: from the points that divide edges into six,
/// and those between them. Where one exceeds the error, the
/// mesh's vertices there are held fixed, and it is decimated again, up to twelve times in all; if
/// that does not help, the mesh is returned unchanged. Vertices of the result are vertices of the
/// mesh.
///
/// A mesh of more than two million triangles is decimated in blocks first, with half of the error
/// and with the vertices on the borders of blocks kept fixed, and then as a whole. In addition to
/// the mesh, this takes about a kilobyte of memory for each triangle of a block, or for each of
/// three times `most` triangles.
/// @throws InputError where an edge has more than two triangles or is badly oriented; OptionError;
///   Interrupted.
Decimation decimate(TriangleMesh mesh, const DecimateOptions& options,
                    const std::stop_token& stop = {});

/// The mesh that `decimate` gives, without the report.
TriangleMesh decimated(TriangleMesh mesh, const DecimateOptions& options,
                       const std::stop_token& stop = {});

/// The mesh decimated to at most `most` triangles.
TriangleMesh decimated(TriangleMesh mesh, std::size_t most, const std::stop_token& stop = {});

}  // namespace qjulia
