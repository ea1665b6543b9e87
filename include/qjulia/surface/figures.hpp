#pragma once
/// Figures of a surface: area, volume, dimension, components and thickness of walls.

#include <limits>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <stop_token>

#include "qjulia/surface/surface.hpp"

namespace qjulia {

/// The slope of ln N(s) over ln 1/s, where N(s) is the number of boxes of side s that hold a point.
struct BoxDimension {
  double dimension;  ///< not a number where fewer than three sizes of boxes fit
  double error;      ///< standard error of the slope
  int sizes;         ///< sizes counted, each half the one before
};

/// The box-counting dimension of a set of points, by boxes from 1/8 of the longest side down to the
/// last half that is at least `finest` wide, and 1/512.
BoxDimension box_dimension(std::span<const Eigen::Vector3f> points, double finest);

/// Units of the mesh.
struct SurfaceFigures {
  std::size_t components = 0;
  std::size_t vertices = 0;  ///< that triangles use
  std::size_t triangles = 0;
  double area = 0;
  double volume = 0;  ///< enclosed, by the divergence theorem
  double dimension = std::numeric_limits<double>::quiet_NaN();  ///< box-counting dimension; not a
                                                                ///< number on too coarse a mesh
  double dimension_error = std::numeric_limits<double>::quiet_NaN();  ///< its standard error
  int box_sizes = 0;  ///< sizes of boxes that were counted
};
/// Area, volume, area per volume, dimension, its error and the sizes of boxes.
nlohmann::json to_json(const SurfaceFigures& figures);

/// Connected parts that were left out.
struct LoosePieces {
  std::size_t count = 0;
  double volume = 0;  ///< sum of sizes, the mesh's units
  double share = 0;   ///< volume, over that of all parts
};

/// Measures a mesh as it passes by, and finds its connected parts. The fractal dimension comes from
/// counts of boxes as small as four mean edges. Of a mesh whose edges are too long for that and
/// that has at most a million triangles, boxes are counted over points on its triangles. Keeps 16
/// bytes a vertex (32 while it makes room for more) and up to 12 MiB of triangles.
class FigureSink : public SurfaceSink {
 public:
  /// @param next gets all that comes, unless it is null.
  explicit FigureSink(SurfaceSink* next = nullptr);
  /// Measures a whole mesh, with all its triangles, however many.
  /// @param stop ends the measuring: Interrupted.
  explicit FigureSink(const TriangleMesh& mesh, const std::stop_token& stop = {});
  ~FigureSink() override;
  FigureSink(const FigureSink&) = delete;
  FigureSink& operator=(const FigureSink&) = delete;

  void vertices(std::span<const Eigen::Vector3d> positions,
                std::span<const Eigen::Vector3d> normals) override;
  void triangles(std::span<const Triangle> triangles) override;

  /// Drops the parts that enclose less than a hundredth of the volume of the largest: pieces beside
  /// the body, and bubbles in it. Parts with an open edge stay. Parts are dropped once, after the
  /// last triangle.
  LoosePieces drop_loose_pieces();
  /// Drops the parts with less than `least` times the area of the largest, 0 … 1; 1 keeps only the
  /// largest (one of several).
  void drop_small_parts(double least);

  /// Whether a vertex has triangles, of a part that was not dropped.
  bool keeps(std::uint32_t vertex) const;
  /// What was not dropped of the mesh that has come.
  TriangleMesh kept_of(const TriangleMesh& mesh) const;

  /// The figures of all triangles that have come with their vertices and were not dropped.
  SurfaceFigures figures() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Figures of a whole mesh, of however many triangles.
SurfaceFigures measure(const TriangleMesh& mesh, const std::stop_token& stop = {});

/// The mesh after `FigureSink::drop_small_parts`.
TriangleMesh large_components(const TriangleMesh& mesh, double least);

/// The same as `FigureSink::drop_loose_pieces`, of a mesh in memory.
LoosePieces drop_loose_pieces(TriangleMesh& mesh);

/// How thick the walls of a closed mesh are: diameters of the largest balls inside that touch the
/// surface at sampled points, in the mesh's units, at most 0.2 % too large. What a ball meets less
/// than 40° from its point, as seen from its centre, counts as the same wall and does not make the
/// ball smaller, because triangles may stand for a round surface. There the ball stays inside the
/// mesh, and comes near its point without quite touching it.
struct WallThickness {
  double thinnest = 0;  ///< a hundredth of the surface is thinner
  double tenth = 0;     ///< a tenth of the surface is thinner
  double median = 0;
};
/// @param stop ends the work: Interrupted. @throws InputError when the mesh has no area.
WallThickness wall_thickness(const TriangleMesh& mesh, const std::stop_token& stop = {});

}  // namespace qjulia
