#pragma once
/// `extract_surface` for callers that know the stop radii.

#include "qjulia/surface.hpp"

namespace qjulia {

/// Map and options are valid.
SurfaceReport set_surface(const Device& device, const RationalMap& map, const StopRadii& stops,
                          const SurfaceOptions& options, SurfaceSink& sink, const Watch& watch);

/// Keeps a mesh in memory.
class MeshSink : public SurfaceSink {
 public:
  void vertices(std::span<const Eigen::Vector3d> positions,
                std::span<const Eigen::Vector3d> normals) override;
  void triangles(std::span<const Triangle> triangles) override;

  TriangleMesh mesh;
};

}  // namespace qjulia
