#pragma once
/// Intersection over union of two bodies, counted over cells of equal volume.

#include <cstddef>

#include "qjulia/base/box.hpp"

namespace qjulia::shape {

/// The cube whose cells are counted unless another box is given. It is centred on the box of a
/// shape, and its side is 1.15 × the longest side of that box.
inline Box cube_to_count(const Box& box) {
  const Eigen::Vector3d half = Eigen::Vector3d::Constant(0.5 * 1.15 * box.size().maxCoeff());
  return {box.center() - half, box.center() + half};
}

struct Overlap {
  std::size_t intersection = 0;  ///< cells inside both bodies
  std::size_t united = 0;        ///< cells inside either

  void add(bool in_a, bool in_b) {
    intersection += in_a && in_b ? 1 : 0;
    united += in_a || in_b ? 1 : 0;
  }
  /// 0 … 1; 0 when neither body has a cell.
  double iou() const {
    return united == 0 ? 0 : static_cast<double>(intersection) / static_cast<double>(united);
  }
};

}  // namespace qjulia::shape
