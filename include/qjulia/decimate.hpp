#pragma once
/// A mesh of fewer triangles that keeps its shape.

#include <cstddef>
#include <stop_token>

#include "qjulia/mesh.hpp"

namespace qjulia {

/// Collapses edges, the least harmful first, until no more than `most` triangles are left. An edge
/// does as little harm as the sum of squared distances of its new vertex to the planes of the
/// triangles that went into it is small (Garland and Heckbert 1997); a collapse that would fold the
/// surface is left out, so that somewhat more triangles may be left. A closed mesh stays closed.
/// Normals of the result are area-weighted means of the triangles around each vertex; none where
/// `mesh` has none. Colours are means, too, of all vertices that went into one. A mesh that is
/// small enough already comes back as it is.
/// @throws InputError where an edge has more than two triangles or is badly oriented; Interrupted.
TriangleMesh decimated(TriangleMesh mesh, std::size_t most, const std::stop_token& stop = {});

}  // namespace qjulia
