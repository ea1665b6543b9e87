#pragma once
/// Whether this thread may still give files their names.

#include <functional>

namespace qjulia::base {

/// While it lives, `pass` is called before any file that this thread writes replaces its target. If
/// it throws, the target stays as it was.
class OutputGate {
 public:
  explicit OutputGate(std::function<void()> pass);
  ~OutputGate();
  OutputGate(const OutputGate&) = delete;
  OutputGate& operator=(const OutputGate&) = delete;

  /// Passes the thread's gates, innermost first. @throws what they throw
  static void pass();

 private:
  std::function<void()> pass_;
  OutputGate* outer_;
};

}  // namespace qjulia::base
