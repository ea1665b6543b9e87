#pragma once
/// Decimation of meshes that are too large to be decimated as a whole.

#include <stop_token>

#include "qjulia/mesh/decimate.hpp"

namespace qjulia::shape {

/// Decimates block after block, with the vertices between them left where they are.
/// @param most_in_a_block triangles; fewer than 65,535 blocks.
TriangleMesh decimated_in_blocks(TriangleMesh mesh, const DecimateOptions& options,
                                 std::size_t most_in_a_block, const std::stop_token& stop);

}  // namespace qjulia::shape
