/// The one source that sees OpenVDB's headers, which take long to compile.

#include "volume/openvdb_module.hpp"

#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/Dense.h>
#include <openvdb/tools/MeshToVolume.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

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

void write_grids(const openvdb::GridPtrVec& grids, const VolumeNote& about, std::ostream& out) {
  openvdb::MetaMap about_file;
  about_file.insertMeta("creator", openvdb::StringMetadata("qjulia"));
  about_file.insertMeta("name", openvdb::StringMetadata(about.name));
  about_file.insertMeta("made_with", openvdb::StringMetadata(about.note));
  openvdb::io::Stream(out).write(grids, about_file);
}

openvdb::FloatGrid::Ptr empty_grid(const char* name, float background,
                                   const openvdb::math::Transform::Ptr& transform) {
  auto grid = openvdb::FloatGrid::create(background);
  grid->setName(name);
  grid->setTransform(transform);
  return grid;
}

/// Voxels whose places are the cells' centres.
openvdb::math::Transform::Ptr transform_of(const Cells& cells) {
  openvdb::Mat4R matrix = openvdb::Mat4R::identity();
  for (int i = 0; i < 3; ++i) {
    matrix(i, i) = cells.step[i];
    matrix(3, i) = cells.first[i];
  }
  return openvdb::math::Transform::createLinearTransform(matrix);
}

/// Hands values to its grids some slices of x at a time. Beyond the box lies what is outside.
class FilledGrids : public FieldGrids {
 public:
  FilledGrids(const Cells& cells, double level)
      : cells_(cells),
        level_(static_cast<float>(level)),
        field_(empty_grid("F", std::numeric_limits<float>::max(), transform_of(cells))),
        density_(empty_grid("density", 0, transform_of(cells))) {
    density_->setGridClass(openvdb::GRID_FOG_VOLUME);
    field_->insertMeta("surface_level", openvdb::DoubleMetadata(level));
  }

  void take(std::span<const double> values) override {
    for (const double value : values) {
      waiting_.push_back(static_cast<float>(value));
      if (waiting_.size() == slice() * kSlices) flush();
    }
  }

  void write(const VolumeNote& about, std::ostream& out) override {
    flush();
    write_grids({field_, density_}, about, out);
  }

 private:
  static constexpr std::size_t kSlices = 8;  // as wide as OpenVDB's leaves

  std::size_t slice() const {
    return static_cast<std::size_t>(cells_.count[1]) * static_cast<std::size_t>(cells_.count[2]);
  }

  void flush() {
    if (waiting_.empty()) return;
    const int count = static_cast<int>(waiting_.size() / slice());
    const openvdb::CoordBBox box({done_, 0, 0},
                                 {done_ + count - 1, cells_.count[1] - 1, cells_.count[2] - 1});
    openvdb::tools::Dense<float> dense(box, waiting_.data());
    openvdb::tools::copyFromDense(dense, *field_, 0.0F);
    for (float& value : waiting_) {
      value = std::isnan(value) ? 0.0F : std::clamp(level_ - value, 0.0F, 1.0F);
    }
    openvdb::tools::copyFromDense(dense, *density_, 0.0F);
    waiting_.clear();
    done_ += count;
  }

  Cells cells_;
  float level_;
  openvdb::FloatGrid::Ptr field_, density_;
  int done_ = 0;  ///< slices
  std::vector<float> waiting_;
};

void write_level_set(const TriangleMesh& mesh, double voxel, const Eigen::Matrix3d& turn,
                     const VolumeNote& about, std::ostream& out) {
  constexpr float kHalfWidth = 3;  // voxels
  const auto transform = openvdb::math::Transform::createLinearTransform(voxel);
  const auto grid = openvdb::tools::meshToVolume<openvdb::FloatGrid>(
      VoxelMesh(mesh, turn / voxel), *transform, kHalfWidth, kHalfWidth);
  grid->setName("surface");
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  write_grids({grid}, about, out);
}

std::unique_ptr<FieldGrids> field_grids(const Cells& cells, double level) {
  return std::make_unique<FilledGrids>(cells, level);
}

}  // namespace

extern "C" const OpenVdb* qjulia_openvdb() {
  openvdb::initialize();
  static const OpenVdb functions{QJULIA_MODULE_VERSION, openvdb::getLibraryVersionString(),
                                 write_level_set, field_grids};
  return &functions;
}

}  // namespace qjulia::volume
