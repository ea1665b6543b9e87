#pragma once
/// A fit that pages watch while it runs.

#include <functional>
#include <mutex>
#include <nlohmann/json.hpp>
#include <stop_token>
#include <string>
#include <vector>

#include "qjulia/device.hpp"
#include "qjulia/fit.hpp"
#include "qjulia/mesh.hpp"

namespace qjulia::explore {

/// What is to be fitted, and who else hears of it.
struct FitTask {
  TriangleMesh mesh;
  FitOptions options{};
  std::function<void(const Progress&)> on_progress{};
  /// Unless it fails. It may add to the result.
  std::function<void(FitResult&)> on_end{};
};

class LiveFit {
 public:
  explicit LiveFit(FitTask task) : task_(std::move(task)) {}

  FitTask& task() { return task_; }

  /// @param take gets the map before the first stage and after each.
  /// @param pause is called between evaluations.
  /// @param end ends it, and what was reached is lost. @throws Interrupted then, and what `fit`
  /// throws.
  void run(const Device& device, const std::stop_token& end,
           const std::function<void(const RationalMap&)>& take, const std::function<void()>& pause);

  /// Ends it with what was reached. From any thread, as what follows.
  void stop() { stop_.request_stop(); }
  /// How it stands: `state` ("runs", "done"), `activity`, `detail`, `fraction`, `seconds_left`,
  /// `stages`, each with `name` and `iou`, and `energies`, a list for each stage.
  std::string json() const;

 private:
  FitTask task_;
  std::stop_source stop_;
  mutable std::mutex mutex_;
  bool is_done_ = false;
  Progress progress_{};
  nlohmann::json stages_ = nlohmann::json::array();
  std::vector<std::vector<double>> energies_{{}};
};

}  // namespace qjulia::explore
