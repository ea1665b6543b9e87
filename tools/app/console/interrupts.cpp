#include "console/interrupts.hpp"

#include <pthread.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <initializer_list>

#include "base/crash_marker.hpp"
#include "console/failure.hpp"

namespace qjulia::tools {
namespace {

sigset_t set_of(std::initializer_list<int> signals) {
  sigset_t set;
  sigemptyset(&set);
  for (const int signal : signals) sigaddset(&set, signal);
  return set;
}

bool ignores_hangup = false;

/// What asks the program to end. nohup has SIGHUP ignored.
sigset_t watched_signals() {
  return ignores_hangup ? set_of({SIGINT, SIGTERM}) : set_of({SIGINT, SIGTERM, SIGHUP});
}

}  // namespace

void see_hangup() {
  struct sigaction hangup {};
  ignores_hangup = sigaction(SIGHUP, nullptr, &hangup) == 0 && hangup.sa_handler == SIG_IGN;
}

Interrupts::Interrupts() : watched_(watched_signals()) {
  // SIGHUP in any case: LLVM, in drivers, handles it even where it is ignored, by removing the
  // files that it is writing.
  const sigset_t blocked = set_of({SIGINT, SIGTERM, SIGHUP});
  pthread_sigmask(SIG_BLOCK, &blocked, nullptr);
  thread_ = std::thread([this] { wait_for_signals(); });
}

Interrupts::~Interrupts() {
  done_ = true;
  pthread_kill(thread_.native_handle(), SIGINT);  // wakes it up
  thread_.join();
}

void Interrupts::wait_for_signals() {
  // A launcher and its process group may both send the signal of one Ctrl-C.
  constexpr std::chrono::seconds kOneRequest{1};
  std::chrono::steady_clock::time_point requested;
  while (true) {
    int signal = 0;
    sigwait(&watched_, &signal);
    if (done_) return;
    const auto now = std::chrono::steady_clock::now();
    if (!stop_.stop_requested()) {
      requested = now;
      stop_.request_stop();
    } else if (now - requested > kOneRequest) {
      base::CrashMarker::forget_all();
      _exit(kInterrupted);
    }
  }
}

}  // namespace qjulia::tools
