#pragma once
/// Work without Python's global lock, and how it ends when Python ends.

#include <pybind11/pybind11.h>

#include <stop_token>

#include "qjulia/base/error.hpp"

namespace qjulia::python {

/// Lets go of Python's lock while it lives, so that other threads run. Threads that ask for the
/// lock while Python is being taken down are ended in the middle of C++, which would end the
/// process as a crash does; so Python's end waits for all that is unlocked.
/// @throws Interrupted once Python has begun to end, in threads other than that which ends it
class Unlocked {
 public:
  Unlocked() = default;
  Unlocked(const Unlocked&) = delete;
  Unlocked& operator=(const Unlocked&) = delete;

 private:
  /// Counts the threads without the lock. It lives until `release_` has ended, when the thread has
  /// the lock again.
  struct Counted {
    Counted();
    ~Counted();
    Counted(const Counted&) = delete;
    Counted& operator=(const Counted&) = delete;
  };
  Counted counted_;
  pybind11::gil_scoped_release release_;
};

/// Destroys what may wait for a device, without Python's lock: the device may wait for what another
/// thread of Python does. With the lock where Python has begun to end.
template <class Destroy>
void destroy_unlocked(const Destroy& destroy) {
  try {
    const Unlocked unlocked;
    destroy();
    return;
  } catch (const Interrupted&) {
  }
  destroy();
}

/// Asks for a stop when Python ends.
std::stop_token end_of_python();

/// Registers with Python's `atexit` that work of other threads ends first.
void add_end_of_work(pybind11::module_& module);

}  // namespace qjulia::python
