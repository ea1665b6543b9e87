#pragma once
/// A fit of a mesh, from its options to its result.

#include <optional>

#include "fit/mesh_problem.hpp"
#include "fit/stages.hpp"
#include "fit/team.hpp"

namespace qjulia::fitting {

class FitRun {
 public:
  /// Measures the mesh and places the factors, or takes up the checkpoint.
  /// @throws InputError, OptionError, Interrupted
  FitRun(Team& team, const Device& device, const TriangleMesh& mesh, FitOptions options,
         ProgressMonitor monitor);
  FitRun(const FitRun&) = delete;  // its stages refer to its problem
  FitRun& operator=(const FitRun&) = delete;

  Stages& stages() { return stages_; }
  const Stages& stages() const { return stages_; }
  /// The map that the fit would give if it ended here.
  Map map() const;
  /// The result of a fit that has ended.
  FitResult result();
  /// Runs all stages.
  FitResult whole();

 private:
  /// A mesh that was measured, and how its fit goes.
  struct Prepared {
    MeasuredMesh mesh;
    FitPlan plan;
    std::optional<FitState> kept{};  ///< where an earlier process stood
  };

  static Prepared prepared(Team& team, const Device& device, const TriangleMesh& mesh,
                           FitOptions options, ProgressMonitor monitor);
  FitRun(Team& team, const Device& device, Prepared prepared);
  /// The stages, at the map where they start.
  Stages begun(const Device& device, Prepared prepared) const;

  /// IoU of the map's own shape, n = 1.
  double overlap_of_shape(const FitResult& result) const;

  ProgressMonitor monitor_;
  MeshProblem own_;
  DividedProblem problem_;  ///< the same, shared by the team
  Stages stages_;
};

}  // namespace qjulia::fitting
