#pragma once
/// The problem of fitting a map to a mesh on a device.

#include <stop_token>

#include "fit/problem.hpp"
#include "fit/sample_pool.hpp"
#include "fit/sample_weights.hpp"
#include "qjulia/device/device.hpp"
#include "qjulia/mesh/shape.hpp"

namespace qjulia::fitting {

/// A mesh as a fit sees it.
struct MeasuredMesh {
  Shape shape;
  SignedDistance distance;  ///< to `shape.mesh`
  SamplePool pool;
  double detail = 0;  ///< δ wanted of the finished map, a fraction of the box's diagonal
  std::vector<std::string> warnings{};  ///< about how it was measured, a sentence each
  double steepness = 1;                 ///< of the finished map, as is `up`
  std::optional<UpAxis> up{};
};

/// Number of cells along each side of the cube in which overlaps are counted.
constexpr int kOverlapCells = 48;

class MeshProblem final : public Problem {
 public:
  /// @param weights of samples, or none. @param precision of energies and gradients. @param stop
  ///   makes this and `draw` throw Interrupted.
  MeshProblem(const Device& device, MeasuredMesh mesh, SampleWeights weights, Precision precision,
              std::stop_token stop = {});

  Samples draw(const Level& level, base::Random& random) const override;
  std::unique_ptr<Evaluator> evaluator(const Samples& samples,
                                       const EnergySettings& options) const override;
  std::vector<double> distances(const std::vector<Eigen::Vector3d>& points) const override;
  double overlap(const Map& map, int iterations) const override;
  FinishedMap finished(const Map& map) const override;

  const MeasuredMesh& mesh() const { return mesh_; }
  /// Mean distance of a finished map's surface from the mesh, to first order, as a fraction of the
  /// box's diagonal.
  double mean_distance(const Map& map) const;
  /// A warning about a finished map with this IoU at n = 1; empty where it fits well.
  std::string poor_fit(const Map& map, double iou) const;

 private:
  Device device_;
  MeasuredMesh mesh_;
  SampleWeights weights_;
  Precision precision_;
  std::stop_token stop_;
  std::vector<Quaternion> cells_;  ///< centres of a coarse grid's cells about the shape
  std::vector<bool> inside_;       ///< which of them are inside it
};

}  // namespace qjulia::fitting
