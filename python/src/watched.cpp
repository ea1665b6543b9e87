#include "watched.hpp"

#include <thread>
#include <utility>

#include "unlocked.hpp"

namespace py = pybind11;

namespace qjulia::python {
ProgressMonitor Watcher::monitor(const py::object& on_progress) {
  ProgressMonitor monitor;
  monitor.stop = token();
  if (!on_progress.is_none()) {
    monitor.on_progress = [this, call = py::handle(on_progress)](const Progress& progress) {
      on_caller([&] {
        call(progress.activity, progress.fraction, progress.seconds_left, progress.detail);
      });
    };
  }
  return monitor;
}

void Watcher::on_caller(const std::function<void()>& call) {
  std::unique_lock lock(mutex_);
  // Work may report from several threads.
  changed_.wait(lock, [&] { return requested_ == nullptr; });
  if (stop_.stop_requested()) return;
  requested_ = &call;
  changed_.notify_all();
  changed_.wait(lock, [&] { return requested_ != &call; });
}

void Watcher::run(const OpenDevice& device, const std::function<void()>& work) {
  {
    const DeviceUse use(device);
    const std::stop_callback at_end(end_of_python(), [this] { stop_.request_stop(); });
    serve(work);
  }
  const auto thrown = std::exchange(thrown_, nullptr);
  const auto kept = std::exchange(kept_, std::nullopt);
  if (kept && !(is_harmless(*kept) && !thrown)) throw *kept;
  if (thrown) std::rethrow_exception(thrown);
}

void Watcher::serve(const std::function<void()>& work) {
  is_done_ = false;
  const Unlocked unlocked;
  std::thread worker([&] {
    try {
      work();
    } catch (...) {
      thrown_ = std::current_exception();
    }
    const std::lock_guard lock(mutex_);
    is_done_ = true;
    changed_.notify_all();
  });
  std::unique_lock lock(mutex_);
  while (!is_done_) {
    changed_.wait_for(lock, kBetweenLooks, [&] { return is_done_ || requested_ != nullptr; });
    if (is_done_) break;
    const auto* const call = requested_;
    lock.unlock();
    look_after(call);
    lock.lock();
    if (call != nullptr) requested_ = nullptr;
    changed_.notify_all();
  }
  lock.unlock();
  worker.join();
}

void Watcher::look_after(const std::function<void()>* call) {
  const py::gil_scoped_acquire acquire;
  try {
    if (call != nullptr) (*call)();
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
  } catch (py::error_already_set& error) {
    keep(std::move(error));
  } catch (const py::builtin_exception& error) {  // what was read of a callback's result
    error.set_error();
    keep(py::error_already_set());
  } catch (...) {  // a callback that called the library
    PyErr_SetString(PyExc_RuntimeError, "a callback failed");
    keep(py::error_already_set());
  }
}

void Watcher::keep(py::error_already_set error) {
  // The first error counts, unless it only asks for a stop.
  if (!kept_ || is_harmless(*kept_)) kept_.emplace(std::move(error));
  stop_.request_stop();
}

bool Watcher::is_harmless(const py::error_already_set& error) const {
  return keeps_result_ &&
         (error.matches(PyExc_KeyboardInterrupt) || error.matches(PyExc_StopIteration));
}

}  // namespace qjulia::python
