#pragma once
/// Intersection over union of two bodies, counted over cells of equal volume.

#include <cstddef>

namespace qjulia::shape {

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
