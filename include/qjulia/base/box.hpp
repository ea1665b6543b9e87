#pragma once
/// An axis-aligned box.

#include <Eigen/Core>

namespace qjulia {

struct Box {
  Eigen::Vector3d low = Eigen::Vector3d::Zero();
  Eigen::Vector3d high = Eigen::Vector3d::Zero();

  Eigen::Vector3d size() const { return high - low; }
  Eigen::Vector3d center() const { return 0.5 * (low + high); }
  double diagonal() const { return size().norm(); }
};

}  // namespace qjulia
