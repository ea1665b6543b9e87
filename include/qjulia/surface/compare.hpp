#pragma once
/// How well a map fits a mesh.

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "qjulia/base/progress.hpp"
#include "qjulia/device/device.hpp"
#include "qjulia/map/map.hpp"
#include "qjulia/mesh/mesh.hpp"

namespace qjulia {

struct CompareOptions {
  int resolution = 128;  ///< cells along each side of the cube the IoU is taken over
  int iterations = 6;
  /// Shape units: only what lies in it is compared; by default, a cube about the mesh.
  std::optional<Box> box = std::nullopt;
  Precision precision =
      Precision::single;  ///< arithmetic of the orbits; double where the device has it
  /// Radius beyond which orbits end, map units; by default where none returns from.
  std::optional<double> escape = std::nullopt;
  /// Also count limbs: where the mesh reaches farther from the map's origin, through its inside,
  /// than anything about, by a tenth of its longest side. Of all the mesh: not with a box.
  bool limbs = false;
  void validate() const;  ///< @throws InputError
};

/// Figures at one number of iterations. Distances are fractions of the mesh's box diagonal. Figures
/// that are undefined are NaN: IoU and energy if no cell's centre lies in the mesh, distances if
/// the set has no surface on the grid, and the roughness if both hold.
struct FitMetrics {
  int iterations = 1;
  double iou = 0;
  double mean_distance = 0;       ///< between the surfaces, mean of both directions
  double distance_95 = 0;         ///< that 95 % of the samples of either surface stay within
  double hausdorff_distance = 0;  ///< largest distance of a surface sample
  /// −Σ w s tanh(α (F_n − L)) over the cells: −1 is perfect. α = 10, w ∝ 1 / max(distance, half a
  /// cell), weights inside and outside of sum ½ each (Kim 2015, Eq. 10, normalised).
  double energy = 0;
  double roughness = 0;  ///< area of the set over the mesh's
  /// Coefficient of variation of ‖∇F_1‖ (3-D) over the mesh's surface, the same for every n: how
  /// uneven the shell's thickness is.
  double slope_variation = 0;
  int limbs = -1;       ///< that the mesh has; −1: not counted
  int limbs_kept = -1;  ///< those that reach into the last quarter of their length in the set
};

/// Metrics at n = 1 and at `options.iterations`. The IoU is taken at cell centres of a cube centred
/// on the mesh's box, side 1.15 × its longest side; or of `options.box`.
/// @throws InputError naming the option or what is wrong with the map or mesh.
std::vector<FitMetrics> compare(const Device& device, const Map& map, const TriangleMesh& mesh,
                                const CompareOptions& options, const ProgressMonitor& monitor = {});

/// Why some of the figures are undefined, and what to do; empty if all are numbers.
std::string why_undefined(const FitMetrics& metrics);

/// Undefined figures are null, and the member "undefined" says why.
nlohmann::json to_json(const FitMetrics& metrics);

}  // namespace qjulia
