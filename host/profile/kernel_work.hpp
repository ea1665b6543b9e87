#pragma once
/// What each kernel of the library has to do in a launch, from the launch's own arguments.

#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "device/launch_watch.hpp"
#include "profile/command_profile.hpp"

namespace qjulia::profiling {

/// What a launch has to do, as far as it is known beforehand: 0 where it is not.
struct LaunchWork {
  double slots = 0;      ///< multiply-adds, multiplications and divisions (profile/cost.hpp)
  double bytes = 0;      ///< read and written at least
  bool at_most = false;  ///< orbits may end before they have done all of it
};

/// Nothing where no kernel has that name.
std::optional<LaunchWork> work_of(const device::Launch& launch);

/// Counts the work of all launches of this process.
class WorkCounter final : public device::LaunchWatch {
 public:
  void launched(const device::Launch& launch) override;
  void did(std::string_view kernel, const device::WalkedWork& work) override;
  std::map<std::string, KernelWork> work() const;
  void reset();

 private:
  mutable std::mutex counting_;
  std::map<std::string, KernelWork, std::less<>> work_;
};

}  // namespace qjulia::profiling
