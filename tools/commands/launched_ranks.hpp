#pragma once
/// The ranks that mpirun has started, or this process alone.

#include <functional>
#include <string>
#include <vector>

#include "qjulia/device/device.hpp"
#include "qjulia/fit/ranks.hpp"

namespace qjulia::tools {

/// Starts message passing where this process was launched by mpirun or another launcher that it
/// knows, and gives this rank a kernel cache of its own, since PoCL's is not safe to fill by
/// several processes. Made before the first device is opened.
class LaunchedRanks final : public Ranks {
 public:
  /// @throws Error when it was launched, and this program was built without MPI.
  LaunchedRanks();
  ~LaunchedRanks() override;
  LaunchedRanks(const LaunchedRanks&) = delete;
  LaunchedRanks& operator=(const LaunchedRanks&) = delete;

  int rank() const override { return rank_; }
  int size() const override { return size_; }
  int local_rank() const { return local_rank_; }  ///< among those of this machine
  int local_size() const { return local_size_; }
  std::vector<Numbers> all_gather(const Numbers& mine) override;

 private:
  bool has_joined_ = false;
  int rank_ = 0, size_ = 1, local_rank_ = 0, local_size_ = 1;
};

/// Runs `work` on every rank and lets all meet: a launcher ends the others when one leaves with a
/// code that is not 0.
/// @return the largest of the ranks' exit codes, on each; the first rank that threw says why.
int together(Ranks& ranks, const std::function<int()>& work);

/// The devices that are this rank's part of those wanted, for a machine whose ranks share them: at
/// least one. Alone, what is wanted: every device for "all", else one.
/// @throws NoDeviceError
std::vector<DeviceInfo> devices_of(const LaunchedRanks& ranks, const DeviceChoice& wanted);

}  // namespace qjulia::tools
