#pragma once
/// The energy that devices take, where the system says it.

#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace qjulia::batch {

/// A file that says how many microjoules something has taken.
struct EnergyCounter {
  std::filesystem::path file;
  std::uint64_t range = 0;  ///< above it, it begins again at 0; 0: it does not
};

/// The energy counters of processor packages that this user may read (Linux's intel-rapl, which
/// processors of AMD have too).
std::vector<EnergyCounter> cpu_energy_counters(
    const std::filesystem::path& powercap = "/sys/class/powercap");

/// Those of the GPU at a PCI address, of drivers that count (xe, i915).
std::vector<EnergyCounter> gpu_energy_counters(
    const std::string& pci_address, const std::filesystem::path& pci = "/sys/bus/pci/devices");

/// Shares out what a device takes: entries that run at the same time get equal parts.
class EnergyMeter {
 public:
  explicit EnergyMeter(std::vector<EnergyCounter> counters);

  /// Of one entry, while it lives.
  class Account {
   public:
    explicit Account(EnergyMeter& meter);
    ~Account();
    Account(const Account&) = delete;
    Account& operator=(const Account&) = delete;

    /// Joules since it was made; none where a counter could not be read. Call it more often than
    /// counters begin again at 0, which they do after some minutes.
    std::optional<double> joules();

   private:
    EnergyMeter& meter_;
  };

 private:
  void share_out();
  std::optional<std::uint64_t> read(const EnergyCounter& counter) const;

  std::mutex mutex_;
  std::vector<EnergyCounter> counters_;
  std::vector<std::optional<std::uint64_t>> last_;  ///< by counter
  std::map<const Account*, std::optional<double>> joules_;
};

}  // namespace qjulia::batch
