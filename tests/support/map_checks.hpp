#pragma once
/// What must hold for maps of every kind, against the reference in double precision.

#include <cstdint>
#include <vector>

#include "qjulia/map/field.hpp"
#include "qjulia/picture/picture.hpp"
#include "qjulia/surface/surface.hpp"

namespace qjulia::test {

/// Uniform in the cube that reaches `reach` from `middle` along each axis, with |W| up to
/// `reach_w`.
std::vector<Quaternion> random_points(std::uint64_t seed, std::size_t count, double reach,
                                      double reach_w,
                                      const Eigen::Vector3d& middle = Eigen::Vector3d::Zero());

/// |device − reference| / max(1, |reference|) of F_n, rising; 1e9 where it is not finite.
std::vector<double> sorted_errors(const Field& field, const Map& map,
                                  const std::vector<Quaternion>& points, int iterations);

/// ∂F_1/∂q of the reference, by differences over twice the step.
Quaternion reference_gradient(const Map& map, const Quaternion& q, double step = 1e-5);

/// The same errors of the device's ∂F_1/∂q.
std::vector<double> sorted_gradient_errors(const Field& field, const Map& map,
                                           const std::vector<Quaternion>& points,
                                           double step = 1e-5);

/// Points that lie on another side of the level after six iterates where stop radii end orbits.
std::size_t wrongly_decided(const Map& map, const StopRadii& stops,
                            const std::vector<Quaternion>& points);

struct MadeSurface {
  TriangleMesh mesh;
  SurfaceReport report;
};

/// Checks that the sparse surface has the triangles of the dense one, thousands, and is closed.
MadeSurface checked_surface(const Device& device, const Map& map, SurfaceOptions options);

/// Checks depths of rays against orbits of points along them, which end only beyond the escape
/// radius.
/// @param framed the box that the camera frames, map coordinates.
void check_rays(const Device& device, const Map& map, const Box& framed, int iterations,
                const Camera& camera = {});

}  // namespace qjulia::test
