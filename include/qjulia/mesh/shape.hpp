#pragma once
/// A mesh made ready to fit: signed distance, the deepest interior point, map coordinates.

#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <vector>

#include "qjulia/base/shape_to_map.hpp"
#include "qjulia/device/device.hpp"
#include "qjulia/mesh/mesh.hpp"

namespace qjulia {

/// Signed distance to a triangle mesh, negative inside. Distance is to the nearest triangle; inside
/// is where the generalised winding number exceeds ½ (Barill et al. 2018), so that meshes with
/// holes and triangle soups have a sensible inside. Parts that are inside out are turned first
/// (`oriented_outward`).
class SignedDistance {
 public:
  /// @param stop ends the preparation, which takes seconds for millions of triangles.
  /// @throws InputError when the mesh has no extent.
  SignedDistance(const Device& device, const TriangleMesh& mesh,
                 Precision precision = Precision::single, std::stop_token stop = {});

  /// Distances of the points, in the mesh's units; any number of points. Points that are not finite
  /// are infinitely far.
  /// @param stop ends the work: Interrupted.
  std::vector<double> at(std::span<const Eigen::Vector3d> points,
                         const std::stop_token& stop = {}) const;

  /// Winding numbers of the points: about 1 inside, 0 outside.
  std::vector<double> winding_numbers(std::span<const Eigen::Vector3d> points,
                                      const std::stop_token& stop = {}) const;

 private:
  struct Impl;
  std::shared_ptr<const Impl> impl_;
};

/// A point of the surface with the unit normal of its triangle, outward.
struct SurfacePoint {
  Eigen::Vector3d position;
  Eigen::Vector3d normal;
};

/// `count` points uniform by area; the same for the same seed, with any standard library.
/// @throws InputError when the mesh has no area.
std::vector<SurfacePoint> sample_surface(const TriangleMesh& mesh, std::size_t count,
                                         std::uint64_t seed);

/// The part of a mesh that bounds its inside, and the distance to it.
struct OuterSurface {
  TriangleMesh mesh;
  SignedDistance distance;
  bool leaves_out = false;  ///< parts of the mesh; else `mesh` is all of it, outward
};

/// Parts that are inside out are turned first. Then triangles with the inside on both sides, as
/// where bodies overlap or lie in one another, are left out, and so are those of inside-out bodies
/// with the outside on both sides; triangles of which this holds in part are cut. If less than
/// 0.2 % of a mesh's area is hidden in this way, the mesh is its own outer surface.
/// @param stop ends the search. @throws InputError when the mesh has no extent.
OuterSurface outer_surface(const Device& device, const TriangleMesh& mesh,
                           std::stop_token stop = {});

/// A mesh in map coordinates: longest side 3, the deepest interior point at the origin.
struct Shape {
  TriangleMesh mesh;              ///< its outer surface, map coordinates
  bool has_hidden_parts = false;  ///< that the outer surface leaves out
  ShapeToMap shape_to_map;
  Box box;              ///< the given mesh's, in its own units
  double inradius = 0;  ///< distance of the origin to the surface, map units
};

/// The point of the interior farthest from the surface, to 2e-3 of the box's longest side (and a
/// fifth of the depth); of points about as deep, one near the middle of the box. Found by branch
/// and bound over cells of the box.
struct DeepestPoint {
  Eigen::Vector3d position;
  double inradius;
};
/// @param stop ends the search. @throws InputError when the mesh has no interior.
DeepestPoint deepest_interior_point(const SignedDistance& distance, const Box& box,
                                    std::stop_token stop = {});

/// Normalises a mesh: scale so that the longest side is 3, origin at the deepest interior point.
/// @param stop ends the preparation.
/// @throws InputError when the mesh is flat, has no interior, or is too large or too small (as for
///   `read_mesh`).
Shape make_shape(const Device& device, const TriangleMesh& mesh, const std::stop_token& stop = {});

}  // namespace qjulia
