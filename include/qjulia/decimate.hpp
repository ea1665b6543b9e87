#pragma once
/// A mesh of fewer triangles that keeps its shape.

#include <cstddef>
#include <optional>
#include <stop_token>

#include "qjulia/mesh.hpp"

namespace qjulia {

/// When to stop: where one of the two forbids to go on.
struct DecimateOptions {
  std::optional<std::size_t> most;  ///< triangles; from 4 on
  /// How far mesh and result may be from each other, units of the mesh.
  std::optional<double> error;
  void validate() const;  ///< @throws OptionError also where neither is given
};

/// Collapses edges, the least harmful first, until no more than `most` triangles are left. An edge
/// does as little harm as the sum of squared distances of its new vertex to the planes of the
/// triangles that went into it is small (Garland and Heckbert 1997); a collapse that would fold the
/// surface is left out, so that somewhat more triangles may be left. A closed mesh stays closed.
/// Normals of the result are area-weighted means of the triangles around each vertex; none where
/// `mesh` has none. Colours are means, too, of all vertices that went into one. A mesh that is
/// small enough already comes back as it is.
///
/// Where an error is given, a collapse that would take a vertex of the mesh too far from the
/// surface is left out. Then distances are measured: from the middles of all triangles and edges of
/// the mesh to the result, and from those of the result to the mesh. Where one is larger than the
/// error, the mesh is decimated again, more carefully, four times at most; it comes back as it is
/// if that does not help. Vertices of the result are vertices of the mesh.
///
/// A mesh of more than two million triangles is decimated in blocks first, with the vertices
/// between blocks left alone and half of the error, and then as a whole: beside the mesh, memory
/// holds about a kilobyte for each triangle of a block, or of three times `most`.
/// @throws InputError where an edge has more than two triangles or is badly oriented; OptionError;
///   Interrupted.
TriangleMesh decimated(TriangleMesh mesh, const DecimateOptions& options,
                       const std::stop_token& stop = {});

/// The same, by number alone.
TriangleMesh decimated(TriangleMesh mesh, std::size_t most, const std::stop_token& stop = {});

}  // namespace qjulia
