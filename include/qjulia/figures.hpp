#pragma once
/// Figures of a surface, and its parts.

#include <nlohmann/json.hpp>
#include <vector>

#include "qjulia/device.hpp"
#include "qjulia/surface.hpp"

namespace qjulia {

/// Units of the mesh.
struct SurfaceFigures {
  std::size_t components = 0;
  double area = 0;
  double volume = 0;           ///< enclosed, by the divergence theorem
  double dimension = 0;        ///< by counting boxes; not a number where fewer than three sizes fit
  double dimension_error = 0;  ///< standard error of the slope it is
  int box_sizes = 0;           ///< sizes counted, each half the one before
};
/// Area, volume, area per volume, dimension and its error.
nlohmann::json to_json(const SurfaceFigures& figures);

/// Takes a mesh's figures as it passes by. Keeps 16 bytes a vertex.
///
/// Box-counting dimension: the slope of ln N(s) by ln 1/s, N(s) the number of boxes of side s that
/// hold a point of the surface, for s from 1/8 of the longest side, halved while boxes are at least
/// four mean edges wide and 1/512 of that side.
class FigureSink : public SurfaceSink {
 public:
  explicit FigureSink(SurfaceSink* next = nullptr) : next_(next) {}
  void vertices(std::span<const Eigen::Vector3d> positions,
                std::span<const Eigen::Vector3d> normals) override;
  void triangles(std::span<const Triangle> triangles) override;

  /// Of all that came.
  SurfaceFigures figures();

 private:
  void take_complete();
  std::uint32_t root(std::uint32_t vertex);

  SurfaceSink* next_;
  std::vector<Eigen::Vector3f> positions_;
  std::vector<std::uint32_t> parent_;  ///< sets of joined vertices
  std::vector<Triangle> waiting_;      ///< for their vertices
  double area_ = 0;
  double volume_ = 0;
  double edges_ = 0;  ///< sum of the lengths of triangles' edges
  std::size_t triangles_ = 0;
};

SurfaceFigures measure(const TriangleMesh& mesh);

/// The connected parts with at least `least` times the area of the largest; 1 leaves the largest
/// alone (the first of several).
TriangleMesh large_components(const TriangleMesh& mesh, double least);

/// How thick the walls of a closed mesh are: diameters of the largest balls inside that touch the
/// surface at sampled points, in the mesh's units.
struct WallThickness {
  double thinnest = 0;  ///< a hundredth of the surface is thinner
  double tenth = 0;     ///< a tenth of the surface is thinner
  double median = 0;
};
WallThickness wall_thickness(const Device& device, const TriangleMesh& mesh);

}  // namespace qjulia
