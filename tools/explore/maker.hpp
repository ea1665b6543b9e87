#pragma once
/// Files made of what a page shows: meshes, and turntables as moving pictures.

#include <string>

#include "explore/request.hpp"
#include "qjulia/device.hpp"
#include "qjulia/map.hpp"
#include "qjulia/mesh.hpp"
#include "qjulia/progress.hpp"

namespace qjulia::explore {

/// What of the mesh lies below the plane at `most` across an axis (0, 1, 2): triangles that the
/// plane crosses are cut along it, and edges on it are left open. Normals go along.
TriangleMesh cut_away(const TriangleMesh& mesh, int axis, double most);

/// The bytes of the file, as `qjulia surface` or `render --turntable` would make it.
/// @param monitor gets, at last, what the file holds. @throws InputError, Error where the set is
///   empty, Interrupted
std::string made_file(const Device& device, const Map& map, const MakeRequest& request,
                      const ProgressMonitor& monitor);

}  // namespace qjulia::explore
