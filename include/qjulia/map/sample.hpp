#pragma once
/// The field F_n itself at the centres of a box's cells, for other programs to work on.

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <stop_token>
#include <string>

#include "qjulia/base/progress.hpp"
#include "qjulia/map/field.hpp"

namespace qjulia {

struct SampleOptions {
  int resolution = 128;  ///< cells along the box's longest side, 1 … 8192
  int iterations = 6;    ///< n, 1 … 16
  /// Iteration goes on below this radius, map units. By default it is 20, or more where the set or
  /// a portal reaches farther.
  std::optional<double> escape;
  std::optional<Box>
      box;  ///< shape units; by default the shape's box plus 5 %, else all of the set
  Precision precision = Precision::single;
  void validate() const;  ///< @throws InputError
};

/// A box cut into equal cells, nearly cubes. Shape units.
struct CellGrid {
  Box box;
  std::array<int, 3> cells{1, 1, 1};

  Eigen::Vector3d cell() const;  ///< sides of a cell
  Eigen::Vector3d center(int x, int y, int z) const;
  std::size_t size() const;  ///< number of cells
};

/// The cells that `options` ask for. @throws Interrupted
CellGrid sample_grid(const Device& device, const Map& map, const SampleOptions& options,
                     const std::stop_token& stop = {});

enum class CellOrder { z_fastest, x_fastest };

/// F_n at all cell centres, with the escape radius alone (no r_in, no r_out), handed to `take` in
/// pieces of up to a million, in `order`. Memory does not grow with the resolution.
/// @throws InputError naming the option, or what is wrong with the map or the grid; DeviceError,
/// also when double precision is asked for and the device has none.
void sample_field(const Device& device, const Map& map, const SampleOptions& options,
                  const CellGrid& grid, CellOrder order,
                  const std::function<void(std::span<const double>)>& take,
                  const ProgressMonitor& monitor = {});

/// The same into a file, written under a temporary name and renamed. `.npy` (NumPy): an array
/// [x][y][z] in C order, float32, or float64 with double precision. `.vti` (VTK, for ParaView):
/// image data with one point at each cell centre, array `F`; `comment` is put in the file.
/// @throws InputError for another extension; OutputError.
CellGrid write_field(const Device& device, const Map& map, const SampleOptions& options,
                     const std::filesystem::path& path, const std::string& comment = {},
                     const ProgressMonitor& monitor = {});

}  // namespace qjulia
