#pragma once
/// A fit that is under way, kept in a file so that it can go on after the process has died.

#include <chrono>
#include <filesystem>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "fit/energy_names.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/fit/fit.hpp"

namespace qjulia::fitting {

/// Where a fit stands at the start of a stage. From it the stage goes the same way again, bit for
/// bit; `evaluated` spares it the evaluations it has made already.
struct FitState {
  Map map;
  std::string random;   ///< the generator's state, as its standard text
  int level = 0;        ///< the schedule's, to which the next stage belongs
  int planned = 0;      ///< evaluations, by which the pool and the levels go
  int evaluations = 0;  ///< made before the stage
  double seconds = 0;   ///< spent so far, in all processes
  std::vector<StageReport> reports;
  CurvatureSum curvature;             ///< of the stages before
  std::vector<Evaluation> evaluated;  ///< what the unfinished stage has evaluated, in order
  /// The mesh was measured with at most so many triangles. The samples depend on it.
  double most_triangles = std::numeric_limits<double>::infinity();
};

/// What a checkpoint belongs to: mesh, options, device and its settings. Two fits with one key go
/// the same way.
std::string fit_key(const TriangleMesh& mesh, const FitOptions& options, const Device& device);

/// Writes states to one file, each in place of the last, whole or not at all.
class Checkpoint {
 public:
  /// Seconds between saves within a stage.
  static constexpr double kInterval = 10;

  /// @param path empty: nothing is ever written.
  /// @param warn is called once, with the problem, as soon as a state cannot be written.
  Checkpoint(std::filesystem::path path, std::string key, double interval = kInterval,
             std::function<void(const std::string&)> warn = {});

  /// What the file holds; empty if there is none. @throws InputError naming the file when it
  /// belongs to another fit or is damaged.
  std::string read() const;
  /// The state in what `read` returned here or in another process, if there is any.
  /// @throws InputError
  std::optional<FitState> state_in(const std::string& content) const;

  /// Writes the state at the end of a stage. A failure does not end the fit: `problem` describes
  /// it.
  void save(const FitState& state);
  /// A warning about the first state that could not be written; empty: there is none.
  const std::string& problem() const { return problem_; }
  /// During one: true when the last save is long ago.
  bool due() const;

 private:
  using Clock = std::chrono::steady_clock;

  InputError problem_with_file(const char* what) const;

  std::filesystem::path path_;
  std::string key_;
  double interval_;
  std::function<void(const std::string&)> warn_;
  std::string problem_;
  Clock::time_point saved_ = Clock::now();
};

}  // namespace qjulia::fitting
