#pragma once
/// Adds up the work that launches say they have.

#include <functional>
#include <map>
#include <mutex>
#include <string>

#include "device/launch_watch.hpp"
#include "profile/command_profile.hpp"

namespace qjulia::profiling {

/// Counts the work of all launches of this process.
class WorkCounter final : public device::LaunchWatch {
 public:
  void launched(const device::Launch& launch) override;
  void did(std::string_view kernel, double slots) override;
  std::map<std::string, KernelWork> work() const;
  void reset();

 private:
  mutable std::mutex counting_;
  std::map<std::string, KernelWork, std::less<>> work_;
};

}  // namespace qjulia::profiling
