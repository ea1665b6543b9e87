#pragma once
/// From a mesh to a rational map.

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "qjulia/base/detail_choice.hpp"
#include "qjulia/base/progress.hpp"
#include "qjulia/device/device.hpp"
#include "qjulia/fit/ranks.hpp"
#include "qjulia/map/map.hpp"
#include "qjulia/mesh/mesh.hpp"

namespace qjulia {

/// What a fit may change.
enum class Unknowns { exponents, all };

/// Where factors start.
enum class Placement {
  depth,  ///< spread inside and about the shape, as far apart as they are deep
  paper   ///< on the surface, as point charges (Kim 2015)
};

/// One stage of a fit, as it went. Energies of different stages are over different samples, and
/// compare only within a level.
struct StageReport {
  std::string name;  ///< its level's
  int evaluations = 0;
  double energy_before = 0;
  double energy_after = 0;
  double seconds = 0;
  /// Intersection over union of shape and set, counted over 48³ cells, for the map that the fit
  /// would give if it ended with this stage, at `iterations`. `compare` at a resolution of 48 gives
  /// the same.
  double iou = 0;
  int iterations = 1;  ///< n of energies and IoU
};

/// Who watches a fit while it runs. The fit waits for each call; none changes its result.
struct FitObserver {
  /// Gets the energy of each evaluation.
  std::function<void(double)> on_evaluation;
  /// Called with a stage's report after each stage, and with one of the placement before the first.
  /// The map is what the fit would give if it ended there.
  std::function<void(const StageReport&, const Map&)> on_stage;
  /// Gets a warning when there is still time to act on it: that the checkpoint cannot be written.
  /// It comes once, and is among the result's warnings too.
  std::function<void(const std::string&)> on_warning;
};

/// Weights of samples by their positions: for points in the mesh's coordinates, it returns a number
/// of 0 or more for each. It must return the same numbers for the same points in every call.
using SampleWeights = std::function<std::vector<double>(std::span<const Eigen::Vector3d>)>;

/// Every field has a value that suits most shapes; each says when another is better.
struct FitOptions {
  /// 8 … 20000; none: as many as pay. With a time limit that is the largest number that leaves time
  /// for the stages the schedule asks for, on this device, as measured at the start; without one it
  /// is the schedule's own. More factors follow finer features; surfaces and pictures of the map
  /// take time in proportion to them. Above 2,560 no factors are moved to other places.
  std::optional<int> factors;
  /// The largest number that is chosen where `factors` gives none, 1500 by default. Lower it where
  /// maps are to stay small.
  std::optional<int> max_factors;
  /// δ, the thickness of the fractal shell as a fraction of the box's diagonal, 0.0001 … 0.1, or a
  /// word for one that suits the mesh: thin limbs bear less than a round body. Of a body, the set
  /// has but a grain below 0.005 and deep grooves from 0.05 on. Lower it where limbs are lost.
  /// `with_detail` changes it afterwards without another fit; a polished map was polished for this
  /// one.
  DetailChoice detail = DetailWord::automatic;
  /// Change it to see how much of a result is chance: samples and relocated factors are drawn with
  /// it.
  std::uint64_t seed = 1;
  /// Seconds of the whole fit, or what a resumed one may add. Set it where a deadline matters more
  /// than the result: the levels of the schedule then share the time, and results differ from run
  /// to run. For results that repeat, limit evaluations.
  std::optional<double> time_limit;
  /// The most evaluations of energy and gradient; by default the schedule's own number. The levels
  /// share them, so that a hundred give a rough map of the same kind.
  std::optional<int> max_evaluations;
  /// Ends the fit after a stage whose StageReport::iou is this or more, above 0 to 1; of a polished
  /// fit, after a stage of polishing. Set it where a rough map is enough.
  std::optional<double> target_iou;
  /// `exponents` keeps centres where they were placed: for comparison with Kim 2015, or where
  /// centres carry a meaning of their own. It fits less closely.
  Unknowns unknowns = Unknowns::all;
  /// `paper` is for comparison with Kim 2015.
  Placement placement = Placement::depth;
  /// `dbl` shows whether rounding matters, at twice the time on a CPU and up to 64 times on a GPU
  /// made for pictures.
  Precision precision = Precision::single;
  /// A built-in schedule's name (`tight`; `fast` for a fifth of the evaluations with half of the
  /// samples; `paper`, the course of Kim 2015; `follow`, the end of `tight` in a tenth of the
  /// evaluations, for `initial`), or the path of a .toml file. Write your own where a
  /// shape is much thinner than the bands of `tight`, or to fit with another loss.
  std::string schedule = "tight";
  /// A schedule's TOML text (docs/reference/schedules.md), in place of the one that `schedule`
  /// names. Empty: that one.
  std::string schedule_text{};
  /// A rational map to start from in place of a placement: its factors where its own shape_to_map
  /// puts them in the mesh's units, with exponents scaled so that F_1 is a distance again. Set it
  /// to go on with a finished map, to fit a shape that has changed a little, or to begin with
  /// factors placed by a rule of your own. It has 8 … 20000 factors; `factors` is left out or the
  /// same number. Its slice becomes W = 0; steepness, paint and portals are left aside. The stages
  /// are those of any fit: early ones are coarse and move factors that have been settled already,
  /// unless the schedule leaves them out.
  std::optional<Map> initial{};
  /// Multiplies the weights of samples. Use it if some parts of a shape matter more than others,
  /// such as a face; parts with weight 0 do not matter at all. It is called once per stage, with
  /// all samples of the stage that lie on the slice, in the thread that runs the fit. Weights are
  /// scaled afterwards so that their sum does not change; with the loss tanh, the sums of either
  /// side. The fit throws OptionError naming `weights` if there are too few or too many numbers, or
  /// if numbers are below 0, not finite, or 0 for all samples. The initial placement of factors,
  /// IoU and mean distance do not depend on it. A checkpoint identifies it by its values at the
  /// mesh's vertices. Empty: 1 everywhere.
  SampleWeights weights{};
  /// Spends the last two fifths of the budget on the second iterate's set, at the wanted detail.
  /// Set it where the set itself is to follow the shape closely: it has fewer grooves afterwards.
  bool polish = false;
  /// The energy is summed over the samples in this many equal parts, which ranks share. Sums are
  /// the same bits for the same number: set it to the largest number of ranks that a result is to
  /// be repeated on. Each part has its own rounding and its own launches, so that more than the
  /// number of ranks only cost time. By default, that number.
  std::optional<int> sample_parts;
  /// A file to keep the fit in while it is under way, rewritten at each stage's end and every 10 s:
  /// the caller removes it once the result is safe. Set it for fits that take minutes. Empty: none.
  std::filesystem::path checkpoint;
  /// The map's Layers::steepness, which the fit itself does not need. Raise it where many
  /// pieces come loose, or for grooves without tufts that stand off the shape.
  double steepness = 1;
  /// The map's Frame::up; by default what `guess_up` says. Set it where that is wrong: maps
  /// are drawn and exported standing so.
  std::optional<UpAxis> up;
  /// Goes on from the checkpoint, where there is one. The other options, the mesh and the device
  /// must be those it was written with; the time limit may differ.
  bool resume = false;
  /// Set it to show a fit as it goes: a map for each stage takes some tenths of a second.
  FitObserver observer{};

  /// `time_limit`, infinity where there is none.
  double most_seconds() const {
    return time_limit.value_or(std::numeric_limits<double>::infinity());
  }
  void validate() const;  ///< @throws OptionError naming the field
};

/// The TOML text of a schedule, by a built-in one's name or a file's ending in .toml.
/// @throws InputError when there is none.
std::string schedule_text(const std::string& name);

/// Why a fit ended. Each leaves a map that can be used.
enum class StopReason {
  schedule_done,  ///< the schedule's own number of evaluations
  evaluations,    ///< FitOptions::max_evaluations
  time_limit,
  target_iou,   ///< FitOptions::target_iou
  interrupted,  ///< a stop request
  converged     ///< the last level gained next to nothing (on grids alone)
};
std::string to_string(StopReason reason);

struct FitResult {
  Map map;  ///< calibrated, in the shape's own coordinates by its shape_to_map
  StopReason stopped = StopReason::schedule_done;
  int evaluations =
      0;  ///< evaluations of energy and gradient, a resumed fit's earlier ones included
  double seconds = 0;  ///< the same for wall time
  /// The mean distance of the fitted surface (n = 1) from the mesh, to first order, over the
  /// diagonal of the mesh's box.
  double mean_distance = 0;
  std::vector<StageReport> stages;
  std::vector<std::string> warnings;  ///< what a user should know about the map, a sentence each
};

/// Two lines: IoU and mean distance reached, evaluations, time, and why the fit ended.
std::string brief_summary(const FitResult& result);
/// A line for each stage with its energies, then the brief summary.
std::string full_summary(const FitResult& result);

/// A fit that its caller runs stage by stage:
///
///     qjulia::Fit fit(device, mesh, options);
///     while (const auto stage = fit.step()) std::cout << stage->name << stage->iou;
///     const qjulia::FitResult result = fit.result();
///
/// The maps are those of the function `fit`, bit for bit if there is no time limit; a time limit
/// includes the time between steps. Only one thread at a time may use an object, as with its
/// device.
class Fit {
 public:
  /// Measures the mesh and places the factors, or resumes from the checkpoint.
  /// @throws as `fit` does; Interrupted after a stop request.
  Fit(const Device& device, const TriangleMesh& mesh, const FitOptions& options,
      const ProgressMonitor& monitor = {});
  ~Fit();
  Fit(Fit&&) noexcept;
  Fit& operator=(Fit&&) noexcept;

  /// Runs the next stage: some tens of evaluations, each of which takes time in proportion to
  /// samples × factors × n. A stop request ends the stage with what it has reached.
  /// @return its report; nothing where there was no further stage.
  std::optional<StageReport> step();
  /// Why the fit has ended; nothing while there are further stages.
  std::optional<StopReason> stopped() const;
  /// The reports of all stages so far, a resumed fit's earlier ones included.
  const std::vector<StageReport>& stages() const;
  /// The map that the fit would give if it ended here; it can be called before the first stage.
  /// Takes some tenths of a second.
  Map map() const;
  /// Ends the fit and returns its result. If there are further stages, this is like a stop request.
  FitResult result();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Fits a map to a mesh. A stop request ends the fit with what was reached. A resumed fit gives the
/// same factors, scale and level as an uninterrupted one, bit for bit (without a time limit).
/// @throws InputError when the mesh has no interior, or the checkpoint is another fit's.
FitResult fit(const Device& device, const TriangleMesh& mesh, const FitOptions& options,
              const ProgressMonitor& monitor = {});

/// The same with the samples divided over ranks, each with its own device. Every rank calls this
/// with the same mesh and options and gets the same result; rank 0's alone reports progress, keeps
/// the checkpoint, and decides about time and stop requests. An error of one rank ends all: there
/// it is thrown as it is, elsewhere as an Error that names the rank.
FitResult fit(const Device& device, const TriangleMesh& mesh, const FitOptions& options,
              const ProgressMonitor& monitor, Ranks& ranks);

}  // namespace qjulia
