#pragma once
/// The ranks that mpirun has started, or this process alone.

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "qjulia/device.hpp"
#include "qjulia/ranks.hpp"

namespace qjulia::tools {

class LaunchedRanks : public Ranks {
 public:
  virtual int local_rank() const = 0;  ///< among those of this machine
  virtual int local_size() const = 0;
};

/// Runs `work` on every rank and lets all meet: a launcher ends the others when one leaves with a
/// code that is not 0.
/// @return the largest of the ranks' exit codes, on each; the first rank that threw says why.
int together(LaunchedRanks& ranks, const std::function<int()>& work);

/// Starts message passing where this process was launched by mpirun or another launcher that it
/// knows, and gives this rank a kernel cache of its own, since PoCL's is not safe to fill by
/// several processes. Called before the first device is opened.
/// @throws Error when this program was built without MPI.
std::unique_ptr<LaunchedRanks> join_ranks();

/// The devices that are this rank's part of those wanted, for a machine whose ranks share them: at
/// least one. Alone, what is wanted: every device for "all", else one.
/// @throws NoDeviceError
std::vector<DeviceInfo> devices_of(const LaunchedRanks& ranks, const std::string& wanted);

}  // namespace qjulia::tools
