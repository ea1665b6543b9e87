#include <algorithm>
#include <cmath>
#include <tuple>

#include "qjulia/error.hpp"
#include "qjulia/shape.hpp"

namespace qjulia {
namespace {

/// Answers are this close to the best depth, as a fraction of the box's longest side.
constexpr double kTolerance = 5e-4;
/// Cells along the longest side at first.
constexpr int kFirstCells = 24;
/// Cells opened at each level: the most promising ones.
constexpr std::size_t kMostOpened = 16384;
constexpr int kMostLevels = 12;

struct Probe {
  Eigen::Vector3d position;
  double depth;  ///< distance to the surface, positive inside
};

}  // namespace

/// Branch and bound: within a cell the depth exceeds that of its centre by at most the half
/// diagonal, since distance has slope 1. Cells that cannot beat the best centre so far are dropped.
DeepestPoint deepest_interior_point(const SignedDistance& distance, const Box& box) {
  const double longest = box.size().maxCoeff();
  double cell = longest / kFirstCells;
  std::vector<Eigen::Vector3d> centers;
  const Eigen::Array3d cells = (box.size().array() / cell).ceil().max(1);
  const Eigen::Vector3d corner = box.center() - 0.5 * cell * cells.matrix();
  for (double x = 0.5; x < cells.x(); ++x) {
    for (double y = 0.5; y < cells.y(); ++y) {
      for (double z = 0.5; z < cells.z(); ++z) {
        centers.emplace_back(corner + cell * Eigen::Vector3d(x, y, z));
      }
    }
  }

  double deepest = 0;
  std::vector<Probe> inside;
  for (int level = 0; level < kMostLevels && !centers.empty(); ++level, cell /= 2) {
    const auto distances = distance.at(centers);
    std::vector<Probe> probes;
    for (std::size_t i = 0; i < centers.size(); ++i) {
      probes.push_back({centers[i], -distances[i]});
      deepest = std::max(deepest, -distances[i]);
    }
    std::ranges::copy_if(probes, std::back_inserter(inside),
                         [](const Probe& probe) { return probe.depth > 0; });
    // On a thin shape the depth itself is small: ask for a tenth of it.
    const double tolerance = deepest > 0 ? std::min(kTolerance * longest, 0.1 * deepest) : 0;
    const double half_diagonal = 0.5 * std::sqrt(3.0) * cell;
    std::erase_if(probes, [&](const Probe& probe) {
      return probe.depth + half_diagonal <= deepest + tolerance;
    });
    if (probes.size() > kMostOpened) {
      std::ranges::stable_sort(probes, std::ranges::greater{}, &Probe::depth);
      probes.resize(kMostOpened);
    }
    centers.clear();
    for (const Probe& probe : probes) {
      for (int child = 0; child < 8; ++child) {
        const Eigen::Vector3d side((child & 1) != 0 ? 1 : -1, (child & 2) != 0 ? 1 : -1,
                                   (child & 4) != 0 ? 1 : -1);
        centers.emplace_back(probe.position + 0.25 * cell * side);
      }
    }
  }
  if (inside.empty()) {
    throw InputError(
        "the mesh has no interior: it is flat or wide open; give a mesh that encloses a volume");
  }
  // Of all points about as deep, the one nearest to the middle of the box.
  const Eigen::Vector3d middle = box.center();
  const auto best = std::ranges::min_element(inside, {}, [&](const Probe& probe) {
    const bool shallow = probe.depth < deepest - std::min(kTolerance * longest, 0.1 * deepest);
    const Eigen::Vector3d& x = probe.position;
    return std::tuple(shallow, (x - middle).squaredNorm(), x.x(), x.y(), x.z());
  });
  return {best->position, best->depth};
}

}  // namespace qjulia
