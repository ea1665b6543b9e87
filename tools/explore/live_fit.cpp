#include "explore/live_fit.hpp"

namespace qjulia::explore {
namespace {

nlohmann::json to_json(const StageReport& stage) {
  return {{"name", stage.name}, {"evaluations", stage.evaluations}, {"energy", stage.energy_after},
          {"iou", stage.iou},   {"iterations", stage.iterations},   {"seconds", stage.seconds}};
}

}  // namespace

void LiveFit::run(const Device& device, const std::stop_token& end,
                  const std::function<void(const RationalMap&)>& take,
                  const std::function<void()>& pause) {
  const std::stop_callback at_end(end, [this] { stop(); });
  ProgressMonitor monitor;
  monitor.stop = stop_.get_token();
  monitor.on_progress = [&](const Progress& progress) {
    {
      const std::lock_guard lock(mutex_);
      progress_ = progress;
    }
    if (task_.on_progress) task_.on_progress(progress);
    pause();
  };
  FitOptions options = task_.options;
  options.observer.on_evaluation = [&](double energy) {
    {
      const std::lock_guard lock(mutex_);
      energies_.back().push_back(energy);
    }
    pause();
  };
  options.observer.on_stage = [&](const StageReport& stage, const RationalMap& map) {
    take(map);
    {
      const std::lock_guard lock(mutex_);
      stages_.push_back(stage);
      energies_.emplace_back();
    }
    pause();
  };
  FitResult result = fit(device, task_.mesh, options, monitor);
  throw_if_stopped(end);
  if (task_.on_end) task_.on_end(result);
  const std::lock_guard lock(mutex_);
  is_done_ = true;
}

std::string LiveFit::json() const {
  const std::lock_guard lock(mutex_);
  nlohmann::json stages = nlohmann::json::array();
  for (const StageReport& stage : stages_) stages.push_back(to_json(stage));
  return nlohmann::json{{"state", is_done_ ? "done" : "runs"},
                        {"activity", progress_.activity},
                        {"detail", progress_.detail},
                        {"fraction", progress_.fraction},
                        {"seconds_left", progress_.seconds_left},
                        {"stages", stages},
                        {"energies", energies_}}
      .dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace qjulia::explore
