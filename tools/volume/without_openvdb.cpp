#include <fmt/format.h>

#include "qjulia/error.hpp"
#include "volume/volume.hpp"

namespace qjulia::volume {

void expect_openvdb(const std::filesystem::path& path) {
  throw InputError(
      fmt::format("cannot write '{}': this qjulia was built without OpenVDB; write another format, "
                  "or install libopenvdb-dev and build qjulia again",
                  path.string()));
}

std::string openvdb_version() { return "no OpenVDB"; }

void write_level_set(const TriangleMesh& /*mesh*/, double /*voxel*/,
                     const Eigen::Matrix3d& /*turn*/, const VolumeNote& /*about*/,
                     const std::filesystem::path& path) {
  expect_openvdb(path);
}

CellGrid write_grids(const Device& /*device*/, const Map& /*map*/, const SampleOptions& /*options*/,
                     const VolumeNote& /*about*/, const std::filesystem::path& path,
                     const ProgressMonitor& /*monitor*/) {
  expect_openvdb(path);
  return {};
}

}  // namespace qjulia::volume
