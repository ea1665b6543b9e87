#pragma once
/// What the program and its module for OpenVDB (openvdb_module.cpp) say to each other. The module
/// calls nothing of the program's.

#include <Eigen/Core>
#include <iosfwd>
#include <memory>
#include <span>
#include <string>

#include "qjulia/mesh/mesh.hpp"

namespace qjulia::volume {

/// What a file of volumes says besides them: `note`, how it was made, one line of ASCII.
struct VolumeNote {
  std::string name;
  std::string note;
};

/// Cells along x, y and z, with a value at the centre of each.
struct Cells {
  Eigen::Vector3i count;
  Eigen::Vector3d first;  ///< the first cell's centre
  Eigen::Vector3d step;   ///< from centre to centre
};

/// The grids "F" and "density" of a field.
class FieldGrids {
 public:
  virtual ~FieldGrids() = default;
  /// The next values of F, with z fastest, then y.
  virtual void take(std::span<const double> values) = 0;
  /// After the last value.
  virtual void write(const VolumeNote& about, std::ostream& out) = 0;
};

/// Its functions throw std::exceptions where a file cannot be written.
struct OpenVdb {
  const char* built_with;  ///< qjulia's version; stays the first
  const char* version;     ///< OpenVDB's
  void (*write_level_set)(const TriangleMesh& mesh, double voxel, const Eigen::Matrix3d& turn,
                          const VolumeNote& about, std::ostream& out);
  /// @param level the surface's.
  std::unique_ptr<FieldGrids> (*field_grids)(const Cells& cells, double level);
};

/// The module's only function. Named by the program when it loads the module.
extern "C" const OpenVdb* qjulia_openvdb();

}  // namespace qjulia::volume
