#pragma once
/// The ranks that mpirun has started, or this process alone.

#include <functional>
#include <memory>
#include <vector>

#include "qjulia/device.hpp"
#include "qjulia/ranks.hpp"

namespace qjulia::tools {

class LaunchedRanks : public Ranks {
 public:
  virtual int local_rank() const = 0;  ///< among those of this machine
  virtual int local_size() const = 0;

  /// The largest of the ranks' exit codes, for each of them: all meet here before they end, since
  /// a launcher ends the others when one leaves with a code that is not 0.
  int agree(int exit_code);
};

/// Runs `work` on every rank and lets all meet.
/// @return the largest of the ranks' exit codes; the first rank that failed says why.
int together(LaunchedRanks& ranks, const std::function<int()>& work);

/// Rank 0 tells the others that work for them begins; or, at its end, that none will.
class Invitation {
 public:
  explicit Invitation(Ranks& ranks) : ranks_(ranks) {}
  ~Invitation() {
    if (!sent_) ranks_.all(0);
  }
  Invitation(const Invitation&) = delete;
  Invitation& operator=(const Invitation&) = delete;
  void send() {
    sent_ = true;
    ranks_.all(1);
  }

 private:
  Ranks& ranks_;
  bool sent_ = false;
};

/// On the other ranks: whether work begins.
bool is_invited(Ranks& ranks);

/// Starts message passing where this process was launched by mpirun or another launcher that it
/// knows, and gives this rank a kernel cache of its own, since PoCL's is not safe to fill by
/// several processes. Made before the first device is opened.
/// @throws Error when this program was built without MPI.
std::unique_ptr<LaunchedRanks> join_ranks();

/// The devices that are this rank's part of those wanted, for a machine whose ranks share them: at
/// least one. Alone, what is wanted: every device for "all", else one.
/// @throws NoDeviceError
std::vector<DeviceInfo> devices_of(const LaunchedRanks& ranks, const std::string& wanted);

/// Those of `devices` that rank `local_rank` of `local_size` on a machine uses.
std::vector<DeviceInfo> divided(const std::vector<DeviceInfo>& devices, int local_rank,
                                int local_size);

}  // namespace qjulia::tools
