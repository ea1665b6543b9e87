#pragma once
/// SIGINT, SIGTERM and SIGHUP as a stop request.

#include <atomic>
#include <csignal>
#include <stop_token>
#include <thread>

namespace qjulia::tools {

/// Keeps in mind whether SIGHUP is ignored, as under nohup; a program's first step. Libraries may
/// handle SIGHUP before `main`: UCX, which MPI uses in Debian 13, does so to begin a debugger. What
/// the program was started with is seen only before any library's constructor runs.
void see_hangup();

/// While it lives, the first SIGINT, SIGTERM or SIGHUP requests a stop, so that work ends with what
/// it has reached; another more than a second later ends the process at once. Made before any other
/// thread is started: threads inherit the blocked signals.
class Interrupts {
 public:
  Interrupts();
  ~Interrupts();
  Interrupts(const Interrupts&) = delete;
  Interrupts& operator=(const Interrupts&) = delete;

  std::stop_token token() const { return stop_.get_token(); }
  bool requested() const { return stop_.stop_requested(); }

 private:
  void wait_for_signals();

  const sigset_t watched_;
  std::stop_source stop_;
  std::atomic<bool> done_ = false;
  std::thread thread_;
};

}  // namespace qjulia::tools
