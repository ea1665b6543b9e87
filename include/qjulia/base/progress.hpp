#pragma once
/// How long work reports its progress to the caller, and how the caller stops it.

#include <functional>
#include <memory>
#include <stop_token>
#include <string>

#include "qjulia/base/error.hpp"
#include "qjulia/base/trace.hpp"

namespace qjulia {

/// A moment in a long computation.
struct Progress {
  std::string activity;      ///< what is being done, such as "fitting"
  double fraction = 0;       ///< done, 0 … 1
  double seconds_left = -1;  ///< estimate; negative when unknown
  std::string detail;        ///< figures worth showing, such as "E −0.97, IoU 0.95"
};

/// To be called now and then by all that takes a stop token. @throws Interrupted
inline void throw_if_stopped(const std::stop_token& stop) {
  if (stop.stop_requested()) throw Interrupted();
}

/// What every long computation takes. Any member may be empty.
struct ProgressMonitor {
  std::function<void(const Progress&)> on_progress;
  /// When a stop is requested, the computation soon throws `Interrupted`; `fit` returns the map
  /// that it has reached.
  std::stop_token stop;
  /// Takes the stages of the work, where it is divided into any.
  std::shared_ptr<Trace> trace{};

  void report(const Progress& progress) const {
    if (on_progress) on_progress(progress);
  }
};

}  // namespace qjulia
