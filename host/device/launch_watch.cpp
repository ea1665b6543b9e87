#include "device/launch_watch.hpp"

#include <atomic>

namespace qjulia::device {
namespace {

std::atomic<LaunchWatch*>& watching() {
  static std::atomic<LaunchWatch*> instance{nullptr};
  return instance;
}

}  // namespace

LaunchWatch* launch_watch() { return watching().load(); }

WatchedLaunches::WatchedLaunches(LaunchWatch& watch) : before_(watching().exchange(&watch)) {}

WatchedLaunches::~WatchedLaunches() { watching().store(before_); }

}  // namespace qjulia::device
