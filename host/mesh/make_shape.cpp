#include "mesh/make_shape.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "mesh/mesh_report.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/base/progress.hpp"

namespace qjulia {
namespace {

/// Answers are this close to the best, as a fraction of the box's longest side.
constexpr double kTolerance = 5e-4;
/// Among points about as deep the one nearest to the middle of the box is preferred: depth counts
/// this much less for each longest side away from it.
constexpr double kPreference = 1e-3;
/// Cells along the longest side at first.
constexpr int kFirstCells = 24;
/// Cells opened at each level: the most promising ones.
constexpr std::size_t kMostOpened = 8192;
constexpr int kMostLevels = 12;

/// Less is rounding error at the surface, not an interior; a fraction of the longest side.
constexpr double kLeastDepth = 1e-5;

struct Probe {
  Eigen::Vector3d position;
  double depth;  ///< distance to the surface, positive inside
  double score;  ///< depth, a little less away from the middle
};

}  // namespace

/// Branch and bound: within a cell the depth exceeds that of its centre by at most the half
/// diagonal, since distance has slope 1. Cells that cannot beat the best centre so far are dropped.
DeepestPoint deepest_interior_point(const SignedDistance& distance, const Box& box,
                                    std::stop_token stop) {
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

  const Eigen::Vector3d middle = box.center();
  Probe best{middle, 0, 0};
  for (int level = 0; level < kMostLevels && !centers.empty(); ++level, cell /= 2) {
    throw_if_stopped(stop);
    const auto distances = distance.at(centers, stop);
    std::vector<Probe> probes;
    for (std::size_t i = 0; i < centers.size(); ++i) {
      const double away = (centers[i] - middle).norm() / longest;
      const double depth = -distances[i];
      probes.push_back({centers[i], depth, depth * (1 - std::copysign(kPreference, depth) * away)});
      if (probes.back().score > best.score) best = probes.back();
    }
    // On a thin shape the depth itself is small: ask for a tenth of it.
    const double tolerance = std::min(kTolerance * longest, 0.1 * best.score);
    const double half_diagonal = 0.5 * std::sqrt(3.0) * cell;
    std::erase_if(probes, [&](const Probe& probe) {
      return probe.score + half_diagonal <= best.score + tolerance;
    });
    if (probes.size() > kMostOpened) {
      std::ranges::stable_sort(probes, std::ranges::greater{}, &Probe::score);
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
  if (best.depth <= kLeastDepth * longest) {
    throw InputError(
        "the mesh has no interior: it is flat or wide open; give a mesh that encloses a volume");
  }
  return {best.position, best.depth};
}

shape::ShapeWithDistance shape::make_shape_with_distance(const Device& device,
                                                         const TriangleMesh& mesh,
                                                         const std::stop_token& stop) {
  constexpr double kLeastVolume = 1e-7;  // over the longest side cubed
  mesh.validate();
  Shape result;
  result.box = mesh.box();
  if (const std::string problem = shape::size_problem(result.box); !problem.empty()) {
    throw InputError("the mesh cannot be fitted: " + problem);
  }
  const TriangleMesh outward = oriented_outward(mesh, stop);
  if (signed_volume(outward) <= kLeastVolume * std::pow(result.box.size().maxCoeff(), 3)) {
    throw InputError("the mesh encloses no volume: it is flat; give a mesh with an inside");
  }
  OuterSurface outer = outer_surface(device, outward, stop);
  result.mesh = std::move(outer.mesh);
  result.has_hidden_parts = outer.leaves_out;
  const DeepestPoint deepest = deepest_interior_point(outer.distance, result.box, stop);
  const double scale = kMapSide / result.box.size().maxCoeff();
  result.shape_to_map = {scale, -scale * deepest.position};
  result.inradius = scale * deepest.inradius;
  for (auto& x : result.mesh.vertices) x = result.shape_to_map.to_map(x);
  return {std::move(result), std::move(outer.distance)};
}

Shape make_shape(const Device& device, const TriangleMesh& mesh, const std::stop_token& stop) {
  return shape::make_shape_with_distance(device, mesh, stop).shape;
}

}  // namespace qjulia
