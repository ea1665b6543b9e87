#pragma once
/// The ranks that mpirun has started, or this process alone.

#include <chrono>
#include <functional>
#include <list>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "batch/round.hpp"
#include "jobs/session.hpp"
#include "qjulia/device/device.hpp"
#include "qjulia/fit/ranks.hpp"

namespace qjulia::tools {

/// Starts message passing where this process was launched by mpirun or another launcher that it
/// knows, and gives this rank a kernel cache of its own, since PoCL's is not safe to fill by
/// several processes. Made before the first device is opened.
class LaunchedRanks final : public Ranks, public batch::BatchRanks {
 public:
  /// A job inside another command has this process alone: the ranks are that command's.
  /// @throws Error when it was launched, and this program was built without MPI.
  LaunchedRanks();
  ~LaunchedRanks() override;
  LaunchedRanks(const LaunchedRanks&) = delete;
  LaunchedRanks& operator=(const LaunchedRanks&) = delete;

  int rank() const override { return rank_; }
  int size() const override { return size_; }
  int local_rank() const { return local_rank_; }  ///< among those of this machine
  int local_size() const { return local_size_; }
  /// After a rank was lost: without its numbers, and on a rank that was given up, or whose rank 0
  /// is lost, with its own alone.
  std::vector<Numbers> all_gather(const Numbers& mine) override;

  /// How long `exchange` waits for a rank before it is given up. Others wait for rank 0 twice as
  /// long. Time in which this process was stopped itself does not count.
  void set_patience(std::chrono::seconds patience) { patience_ = patience; }
  std::vector<std::optional<std::string>> exchange(const std::string& mine) override;
  std::chrono::milliseconds patience() const override { return patience_; }

  /// To be called last. Where a rank is lost, rank 0 has the launcher end all ranks with this exit
  /// code, since message passing cannot end without the lost one; others wait for that.
  void leave(int code);

 private:
  struct Sending;
  void send(int to, int tag, std::string bytes);
  std::vector<std::optional<std::string>> exchange_as_first(const std::string& mine);

  bool has_joined_ = false;
  int rank_ = 0, size_ = 1, local_rank_ = 0, local_size_ = 1;
  std::chrono::seconds patience_{60};
  std::set<int> lost_;       ///< ranks
  bool is_cut_off_ = false;  ///< this rank was given up, or rank 0 is lost
  std::list<Sending> sent_;  ///< what may not have arrived yet
};

/// Runs `work` on every rank and lets all meet: a launcher ends the others when one leaves with a
/// code that is not 0.
/// @return the largest of the ranks' exit codes, on each; the first rank that threw says why.
int together(Ranks& ranks, const std::function<int()>& work);

/// The devices that are this rank's part of those wanted, for a machine whose ranks share them: at
/// least one. Alone, what is wanted: every device for "all", else one.
/// @throws NoDeviceError
std::vector<DeviceInfo> devices_of(const LaunchedRanks& ranks, const DeviceChoice& wanted);

/// The one of those that are this rank's.
TrustedDevice own_device(const LaunchedRanks& ranks, const TrustedDevice& wanted);
/// Opens it. Of several ranks, the first says which it is.
Device open_rank_device(const LaunchedRanks& ranks, const TrustedDevice& wanted, Session& session);

}  // namespace qjulia::tools
