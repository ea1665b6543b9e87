#include "interrupts.hpp"

#include <pthread.h>
#include <unistd.h>

#include <csignal>

#include "exit_code.hpp"

namespace qjulia::tools {
namespace {

sigset_t watched_signals() {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGINT);
  sigaddset(&set, SIGTERM);
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
  const sigset_t set = watched_signals();
  while (true) {
    int signal = 0;
    sigwait(&set, &signal);
    if (done_) return;
    if (stop_.stop_requested()) _exit(kInterrupted);
    stop_.request_stop();
  }
}

}  // namespace qjulia::tools
