/// The one source that sees OpenVDB's headers, which take long to compile.

#include <fmt/format.h>
#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/Dense.h>
#include <openvdb/tools/MeshToVolume.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "base/output_file.hpp"
#include "qjulia/error.hpp"
#include "volume/volume.hpp"

namespace qjulia::volume {
namespace {

/// A mesh as OpenVDB reads it, in the coordinates of voxels.
class VoxelMesh {
 public:
  VoxelMesh(const TriangleMesh& mesh, const Eigen::Matrix3d& to_voxels)
      : mesh_(mesh), to_voxels_(to_voxels) {}

  std::size_t polygonCount() const { return mesh_.triangles.size(); }    // NOLINT: its names
  std::size_t pointCount() const { return mesh_.vertices.size(); }       // NOLINT
  std::size_t vertexCount(std::size_t /*triangle*/) const { return 3; }  // NOLINT
  void getIndexSpacePoint(std::size_t triangle, std::size_t corner,      // NOLINT
                          openvdb::Vec3d& point) const {
    const Eigen::Vector3d x = to_voxels_ * mesh_.vertices[mesh_.triangles[triangle][corner]];
    point = {x.x(), x.y(), x.z()};
  }

 private:
  const TriangleMesh& mesh_;
  Eigen::Matrix3d to_voxels_;
};

void write_file(const openvdb::GridPtrVec& grids, const VolumeNote& about,
                const std::filesystem::path& path) {
  openvdb::MetaMap about_file;
  about_file.insertMeta("creator", openvdb::StringMetadata("qjulia"));
  about_file.insertMeta("name", openvdb::StringMetadata(about.name));
  about_file.insertMeta("made_with", openvdb::StringMetadata(about.note));
  base::OutputFile file(path);
  try {
    openvdb::io::Stream(file.stream()).write(grids, about_file);
  } catch (const openvdb::Exception& failed) {
    throw OutputError(fmt::format("cannot write '{}': {}", path.string(), failed.what()));
  }
  file.commit();
}

openvdb::FloatGrid::Ptr empty_grid(const char* name, float background,
                                   const openvdb::math::Transform::Ptr& transform) {
  auto grid = openvdb::FloatGrid::create(background);
  grid->setName(name);
  grid->setTransform(transform);
  return grid;
}

/// Voxels whose places are the cells' centres.
openvdb::math::Transform::Ptr transform_of(const CellGrid& cells) {
  const Eigen::Vector3d step = cells.cell(), first = cells.center(0, 0, 0);
  openvdb::Mat4R matrix = openvdb::Mat4R::identity();
  for (int i = 0; i < 3; ++i) {
    matrix(i, i) = step[i];
    matrix(3, i) = first[i];
  }
  return openvdb::math::Transform::createLinearTransform(matrix);
}

/// Takes values with z fastest, then y, and hands them to grids some slices of x at a time.
class SliceFiller {
 public:
  SliceFiller(const CellGrid& cells, openvdb::FloatGrid& field, openvdb::FloatGrid& density,
              double level)
      : cells_(cells), field_(field), density_(density), level_(static_cast<float>(level)) {}

  void take(std::span<const double> values) {
    for (const double value : values) {
      waiting_.push_back(static_cast<float>(value));
      if (waiting_.size() == slice() * kSlices) flush();
    }
  }

  void flush() {
    if (waiting_.empty()) return;
    const int count = static_cast<int>(waiting_.size() / slice());
    const openvdb::CoordBBox box({done_, 0, 0},
                                 {done_ + count - 1, cells_.cells[1] - 1, cells_.cells[2] - 1});
    openvdb::tools::Dense<float> dense(box, waiting_.data());
    openvdb::tools::copyFromDense(dense, field_, 0.0F);
    for (float& value : waiting_) {
      value = std::isnan(value) ? 0.0F : std::clamp(level_ - value, 0.0F, 1.0F);
    }
    openvdb::tools::copyFromDense(dense, density_, 0.0F);
    waiting_.clear();
    done_ += count;
  }

 private:
  static constexpr std::size_t kSlices = 8;  // as wide as OpenVDB's leaves

  std::size_t slice() const {
    return static_cast<std::size_t>(cells_.cells[1]) * static_cast<std::size_t>(cells_.cells[2]);
  }

  const CellGrid& cells_;
  openvdb::FloatGrid& field_;
  openvdb::FloatGrid& density_;
  float level_;
  int done_ = 0;  ///< slices
  std::vector<float> waiting_;
};

}  // namespace

void expect_openvdb(const std::filesystem::path& /*path*/) {}

std::string openvdb_version() {
  return fmt::format("OpenVDB {}", openvdb::getLibraryVersionString());
}

void write_level_set(const TriangleMesh& mesh, double voxel, const Eigen::Matrix3d& turn,
                     const VolumeNote& about, const std::filesystem::path& path) {
  openvdb::initialize();
  constexpr float kHalfWidth = 3;  // voxels
  const auto transform = openvdb::math::Transform::createLinearTransform(voxel);
  const auto grid = openvdb::tools::meshToVolume<openvdb::FloatGrid>(
      VoxelMesh(mesh, turn / voxel), *transform, kHalfWidth, kHalfWidth);
  grid->setName("surface");
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  write_file({grid}, about, path);
}

CellGrid write_grids(const Device& device, const Map& map, const SampleOptions& options,
                     const VolumeNote& about, const std::filesystem::path& path,
                     const ProgressMonitor& monitor) {
  openvdb::initialize();
  CellGrid cells = sample_grid(device, map, options, monitor.stop);
  const auto transform = transform_of(cells);
  const double level = map.dynamics.surface_level;
  // Beyond the box lies what is outside.
  const auto field = empty_grid("F", std::numeric_limits<float>::max(), transform);
  const auto density = empty_grid("density", 0, transform);
  density->setGridClass(openvdb::GRID_FOG_VOLUME);
  field->insertMeta("surface_level", openvdb::DoubleMetadata(level));
  SliceFiller filler(cells, *field, *density, level);
  sample_field(
      device, map, options, cells, CellOrder::z_fastest,
      [&](std::span<const double> values) { filler.take(values); }, monitor);
  filler.flush();
  write_file({field, density}, about, path);
  return cells;
}

}  // namespace qjulia::volume
