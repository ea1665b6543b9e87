#include "interrupts.hpp"

#include <pthread.h>
#include <unistd.h>

#include <chrono>
#include <csignal>

#include "exit_code.hpp"

namespace qjulia::tools {
namespace {

sigset_t watched_signals() {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGINT);
  sigaddset(&set, SIGTERM);
  // nohup has it ignored, which blocking it would undo.
  struct sigaction hangup {};
  if (sigaction(SIGHUP, nullptr, &hangup) == 0 && hangup.sa_handler != SIG_IGN) {
    sigaddset(&set, SIGHUP);
  }
  return set;
}

}  // namespace

Interrupts::Interrupts() {
  const sigset_t set = watched_signals();
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
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
  const sigset_t set = watched_signals();
  std::chrono::steady_clock::time_point requested;
  while (true) {
    int signal = 0;
    sigwait(&set, &signal);
    if (done_) return;
    const auto now = std::chrono::steady_clock::now();
    if (!stop_.stop_requested()) {
      requested = now;
      stop_.request_stop();
    } else if (now - requested > kOneRequest) {
      _exit(kInterrupted);
    }
  }
}

}  // namespace qjulia::tools
