#pragma once
/// From a mesh to a rational map.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "qjulia/device.hpp"
#include "qjulia/mesh.hpp"
#include "qjulia/progress.hpp"
#include "qjulia/ranks.hpp"

namespace qjulia {

enum class Unknowns { exponents, all };

/// Where factors start.
enum class Placement {
  depth,  ///< spread inside and about the shape, as far apart as they are deep
  paper   ///< on the surface, as point charges (Kim 2015)
};

struct FitOptions {
  int factors = 331;     ///< 8 … 20000
  double detail = 0.02;  ///< δ, fraction of the box's diagonal, 0.001 … 0.1
  std::uint64_t seed = 1;
  double time_limit = std::numeric_limits<double>::infinity();  ///< seconds of the whole fit
  int max_evaluations = 0;  ///< of energy and gradient; 0: the schedule's own number
  Unknowns unknowns = Unknowns::all;
  Placement placement = Placement::depth;
  Precision precision = Precision::single;
  std::string schedule = "tight";  ///< a built-in schedule's name, or a .toml file's
  /// Spends the last two fifths of the budget on the second iterate's set, at the wanted detail.
  bool polish = false;
  /// The energy is summed over the samples in this many equal parts, which ranks share. Sums are
  /// the same bits for the same number.
  int sample_parts = 1;
  /// A file to keep the fit in while it is under way, rewritten at each stage's end and every 10 s:
  /// the caller removes it once the result is safe. Empty: none.
  std::filesystem::path checkpoint;
  bool resume = false;    ///< go on from the checkpoint, where there is one
  void validate() const;  ///< @throws InputError naming the option
};

/// The TOML text of a schedule, by a built-in one's name or a file's ending in .toml.
/// @throws InputError when there is none.
std::string schedule_text(const std::string& name);

enum class StopReason { schedule_done, evaluations, time_limit, interrupted, converged };
std::string to_string(StopReason reason);

/// One stage of a fit, as it went.
struct StageReport {
  std::string name;
  int evaluations = 0;
  double energy_before = 0;
  double energy_after = 0;
  double seconds = 0;
  double iou = 0;      ///< on a coarse grid
  int iterations = 1;  ///< n of energies and IoU
};

struct FitResult {
  RationalMap map;  ///< calibrated, in the shape's own coordinates by its shape_to_map
  StopReason stopped = StopReason::schedule_done;
  int evaluations = 0;
  double seconds = 0;
  std::vector<StageReport> stages;
  std::vector<std::string> warnings;
};

/// Fits a map to a mesh. A stop request ends the fit with what was reached. A resumed fit gives the
/// same map as one that was never interrupted, bit for bit (without a time limit).
/// @throws InputError when the mesh has no interior, or the checkpoint is another fit's.
FitResult fit(const Device& device, const TriangleMesh& mesh, const FitOptions& options,
              const Watch& watch = {});

/// The same with the samples divided over ranks, on each rank's own device. Rank 0 calls this, the
/// others `serve_fit`.
FitResult fit(const Device& device, const TriangleMesh& mesh, const FitOptions& options,
              const Watch& watch, Ranks& ranks);

/// Evaluates what rank 0's fit asks for, until that ends. Errors are rank 0's to throw.
/// @param open gives this rank's device, at the first use.
void serve_fit(Ranks& ranks, const std::function<Device()>& open, Precision precision);

}  // namespace qjulia
