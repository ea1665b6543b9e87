#pragma once
/// Long work without Python's lock. It runs on a thread of its own, so that the calling one can
/// look for Ctrl-C and run callbacks, which then are where a user expects them.

#include <pybind11/pybind11.h>

#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <stop_token>

#include "device.hpp"
#include "qjulia/base/progress.hpp"

namespace qjulia::python {

class Watcher {
 public:
  /// @param keeps_result true for work that returns what it has reached when it is asked to stop.
  ///   Ctrl-C, or KeyboardInterrupt or StopIteration from a callback, then ends it without an
  ///   error.
  explicit Watcher(bool keeps_result = false) : keeps_result_(keeps_result) {}

  /// For the work: asks it to stop.
  std::stop_token token() const { return stop_.get_token(); }
  /// For the work: what it reports goes to `on_progress(activity, fraction, seconds_left, detail)`,
  /// unless that is None.
  ProgressMonitor monitor(const pybind11::object& on_progress);
  /// For the work: has the thread that called `run` make this call, with Python's lock, and waits.
  /// After a request to stop it is left out.
  void on_caller(const std::function<void()>& call);

  /// Runs the work to its end. There may be several works, one after the other; a request to stop
  /// is one for those that follow. The device is this thread's alone meanwhile. To be called with
  /// Python's lock, which is let go. @throws what the work or a callback has thrown.
  void run(const OpenDevice& device, const std::function<void()>& work);

  /// Hears a Ctrl-C that came at the end of the last work, so that it ends those that follow and is
  /// no KeyboardInterrupt between two of them. To be called with Python's lock.
  void hear_ctrl_c() { look_after(nullptr); }

 private:
  void serve(const std::function<void()>& work);
  void look_after(const std::function<void()>* call);
  void keep(pybind11::error_already_set error);
  bool is_harmless(const pybind11::error_already_set& error) const;

  bool keeps_result_;
  std::stop_source stop_;
  std::mutex mutex_;
  std::condition_variable changed_;
  const std::function<void()>* requested_ = nullptr;
  bool is_done_ = false;
  std::exception_ptr thrown_;                        ///< by the work
  std::optional<pybind11::error_already_set> kept_;  ///< by Python
};

/// The same for work that has a result and calls nothing back.
template <class Work>
auto watched(const OpenDevice& device, const Work& work) {
  Watcher watcher;
  std::optional<decltype(work(watcher.token()))> result;
  watcher.run(device, [&] { result.emplace(work(watcher.token())); });
  return std::move(*result);
}

}  // namespace qjulia::python
