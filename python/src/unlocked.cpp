#include "unlocked.hpp"

#include <unistd.h>

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>

#include "qjulia/base/error.hpp"

namespace py = pybind11;

namespace qjulia::python {
namespace {

struct Work {
  std::mutex mutex;
  std::condition_variable changed;
  int count = 0;
  std::stop_source end;
  std::thread::id ended_by;
  pid_t process = ::getpid();
};

/// It lives as long as the process: threads may outlive Python.
Work& work() {
  static Work* const all = new Work;
  return *all;
}

/// Long work ends within two seconds after a stop. The wait is bounded, because a callback may wait
/// for something that never comes.
constexpr std::chrono::seconds kLongestWait{10};

void end_work() {
  Work& all = work();
  if (all.process != ::getpid()) return;  // a forked process does not have the other threads
  {
    const std::lock_guard lock(all.mutex);
    all.ended_by = std::this_thread::get_id();
  }
  all.end.request_stop();
  const py::gil_scoped_release release;
  std::unique_lock lock(all.mutex);
  all.changed.wait_for(lock, kLongestWait, [&] { return all.count == 0; });
}

}  // namespace

Unlocked::Counted::Counted() {
  Work& all = work();
  const std::lock_guard lock(all.mutex);
  if (all.end.stop_requested() && all.ended_by != std::this_thread::get_id()) throw Interrupted();
  ++all.count;
}

Unlocked::Counted::~Counted() {
  Work& all = work();
  const std::lock_guard lock(all.mutex);
  --all.count;
  all.changed.notify_all();
}

std::stop_token end_of_python() { return work().end.get_token(); }

void add_end_of_work(py::module_& module) {
  static_cast<void>(work());
  module.def("end_work", &end_work);
  py::module_::import("atexit").attr("register")(module.attr("end_work"));
}

}  // namespace qjulia::python
