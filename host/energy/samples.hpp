#pragma once
/// Points the energy is summed over.

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "layout/loss.h"

namespace qjulia::energy {

/// How F at a sample becomes a term of the energy; kernels know it by the same number.
enum class Loss {
  /// E = −Σ w s tanh(α (F_n − target)), with s = ±1 the side (Kim 2015). −1 is a perfect fit when
  /// the weights of either side sum to ½.
  tanh = QJ_LOSS_TANH,
  /// E = ½ Σ w r². r = F − target; where side ≠ 0 the sample asks only for "at least that far":
  /// r = 0 where side · (F − target) > 0.
  distance = QJ_LOSS_DISTANCE,
  /// E = Σ w t F: its gradient is that of any loss whose derivatives by F_n are w t. For energies
  /// and gradients alone: it has no curvature.
  linear = QJ_LOSS_LINEAR,
};

/// Those that fits have, by their names in schedules.
inline const std::map<std::string, Loss> kLosses{{"distance", Loss::distance},
                                                 {"tanh", Loss::tanh}};

/// Sample points in map coordinates. All vectors have one length.
struct Samples {
  std::vector<Eigen::Vector3d> position;
  std::vector<double> off_slice;  ///< their W less the map's slice; 0 for all that show the shape
  std::vector<double> weight;     ///< w ≥ 0
  std::vector<double> target;     ///< wanted F; with the tanh loss the surface's level
  std::vector<double> side;       ///< +1 outside, −1 inside, 0 neither

  std::size_t size() const { return position.size(); }
  void add(const Eigen::Vector3d& x, double w, double wanted, double s, double from_slice = 0) {
    position.push_back(x);
    off_slice.push_back(from_slice);
    weight.push_back(w);
    target.push_back(wanted);
    side.push_back(s);
  }
  /// The i-th of `from`, which stands for `share` of them.
  void add(const Samples& from, std::size_t i, double share = 1) {
    add(from.position[i], share * from.weight[i], from.target[i], from.side[i], from.off_slice[i]);
  }
};

}  // namespace qjulia::energy
