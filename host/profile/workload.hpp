#pragma once
/// The fixed work that kernels are timed with.

#include "fit/samples.hpp"
#include "qjulia/field.hpp"
#include "qjulia/mesh.hpp"
#include "qjulia/profile.hpp"
#include "qjulia/rational_map.hpp"

namespace qjulia::profiling {

struct Workload {
  fitting::Samples samples;
  RationalMap map;
};
Workload make_workload(const ProfileOptions& options);

/// A sphere of radius 1 by latitude and longitude, 4 · rings · (rings − 1) triangles.
TriangleMesh make_sphere(int rings);

/// An escape radius that no orbit of the workload reaches.
constexpr double kNoEscape = kLargestEscape;

}  // namespace qjulia::profiling
