#pragma once
/// Volumes as OpenVDB files (.vdb), where qjulia was built with OpenVDB. What uses that library is
/// a module, which is loaded when it is needed: OpenVDB and what it needs take 30 MiB and 40 ms.

#include <filesystem>
#include <string>

#include "qjulia/map/sample.hpp"
#include "qjulia/mesh/mesh.hpp"
#include "volume/openvdb_module.hpp"

namespace qjulia::volume {

/// @throws InputError naming the file, where the module is missing or cannot be loaded.
void expect_openvdb(const std::filesystem::path& path);

/// "OpenVDB 10.0.1", or "no OpenVDB".
std::string openvdb_version();

/// Signed distances of the mesh's surface, negative inside, as far as three voxels from it: the
/// grid "surface", a level set in the mesh's own units.
/// @param mesh closed. @param voxel its side. @param turn the mesh is turned by it.
/// @throws InputError as `expect_openvdb`; OutputError.
void write_level_set(const TriangleMesh& mesh, double voxel, const Eigen::Matrix3d& turn,
                     const VolumeNote& about, const std::filesystem::path& path);

/// F_n at the cells' centres as the grid "F", and with it "density", for smoke: the surface level
/// less F_n, between 0 and 1. Shape units. Memory holds both grids, single precision.
/// @throws InputError as `expect_openvdb` and `sample_field`; OutputError.
CellGrid write_grids(const Device& device, const Map& map, const SampleOptions& options,
                     const VolumeNote& about, const std::filesystem::path& path,
                     const ProgressMonitor& monitor);

}  // namespace qjulia::volume
