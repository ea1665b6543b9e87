#include "explore/live_fit.hpp"

namespace qjulia::explore {

void LiveFit::run(const Device& device, const std::stop_token& end,
                  const std::function<void(const RationalMap&)>& take,
                  const std::function<void()>& pause) {
  const std::stop_callback at_end(end, [this] { stop(); });
  const auto keep = [&](const auto& change) {
    {
      const std::lock_guard lock(mutex_);
      change();
    }
    pause();
  };
  ProgressMonitor monitor;
  monitor.stop = stop_.get_token();
  monitor.on_progress = [&](const Progress& progress) {
    if (task_.on_progress) task_.on_progress(progress);
    keep([&] { progress_ = progress; });
  };
  FitOptions options = task_.options;
  options.observer.on_evaluation = [&](double energy) {
    keep([&] { energies_.back().push_back(energy); });
  };
  options.observer.on_stage = [&](const StageReport& stage, const RationalMap& map) {
    take(map);
    keep([&] {
      stages_.push_back({{"name", stage.name}, {"iou", stage.iou}});
      energies_.emplace_back();
    });
  };
  FitResult result = fit(device, task_.mesh, options, monitor);
  throw_if_stopped(end);
  if (task_.on_end) task_.on_end(result);
  const std::lock_guard lock(mutex_);
  is_done_ = true;
}

std::string LiveFit::json() const {
  const std::lock_guard lock(mutex_);
  return nlohmann::json{{"state", is_done_ ? "done" : "runs"},
                        {"activity", progress_.activity},
                        {"detail", progress_.detail},
                        {"fraction", progress_.fraction},
                        {"seconds_left", progress_.seconds_left},
                        {"stages", stages_},
                        {"energies", energies_}}
      .dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace qjulia::explore
