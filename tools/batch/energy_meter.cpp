#include "batch/energy_meter.hpp"

#include <algorithm>
#include <fstream>
#include <system_error>
#include <utility>

namespace qjulia::batch {
namespace {

template <class Value>
std::optional<Value> value_in(const std::filesystem::path& file) {
  std::ifstream stream(file);
  Value value{};
  if (!(stream >> value)) return std::nullopt;
  return value;
}

std::vector<std::filesystem::path> files_of(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  std::error_code error;
  for (std::filesystem::directory_iterator at(folder, error), end; !error && at != end;
       at.increment(error)) {
    files.push_back(at->path());
  }
  std::ranges::sort(files);
  return files;
}

}  // namespace

std::vector<EnergyCounter> cpu_energy_counters(const std::filesystem::path& powercap) {
  std::vector<EnergyCounter> found;
  for (const std::filesystem::path& zone : files_of(powercap)) {
    const auto name = value_in<std::string>(zone / "name");
    if (!name || !name->starts_with("package")) continue;  // others are parts of these, or more
    const auto range = value_in<std::uint64_t>(zone / "max_energy_range_uj");
    if (!range || !value_in<std::uint64_t>(zone / "energy_uj")) continue;
    found.push_back({zone / "energy_uj", *range});
  }
  return found;
}

std::vector<EnergyCounter> gpu_energy_counters(const std::string& pci_address,
                                               const std::filesystem::path& pci) {
  std::vector<EnergyCounter> found;
  if (pci_address.empty()) return found;
  for (const std::filesystem::path& sensors : files_of(pci / pci_address / "hwmon")) {
    const std::filesystem::path file = sensors / "energy1_input";
    if (value_in<std::uint64_t>(file)) found.push_back({file, 0});
  }
  return found;
}

EnergyMeter::EnergyMeter(std::vector<EnergyCounter> counters)
    : counters_(std::move(counters)), last_(counters_.size()) {}

std::optional<std::uint64_t> EnergyMeter::read(const EnergyCounter& counter) const {
  return value_in<std::uint64_t>(counter.file);
}

void EnergyMeter::share_out() {
  double microjoules = 0;
  bool is_known = true;
  for (std::size_t i = 0; i < counters_.size(); ++i) {
    const auto now = read(counters_[i]);
    const auto before = std::exchange(last_[i], now);
    is_known = is_known && now && before;
    if (!is_known) continue;
    const std::uint64_t over = *now < *before ? counters_[i].range : 0;
    if (*now < *before && over == 0) is_known = false;  // a driver that was loaded again
    if (!is_known) continue;
    microjoules += static_cast<double>(*now + over - *before);
  }
  for (auto& [account, joules] : joules_) {
    if (!is_known) joules.reset();
    if (joules) *joules += 1e-6 * microjoules / static_cast<double>(joules_.size());
  }
}

EnergyMeter::Account::Account(EnergyMeter& meter) : meter_(meter) {
  const std::lock_guard lock(meter.mutex_);
  meter.share_out();
  meter.joules_[this] = meter.counters_.empty() ? std::nullopt : std::optional(0.0);
}

EnergyMeter::Account::~Account() {
  const std::lock_guard lock(meter_.mutex_);
  meter_.share_out();
  meter_.joules_.erase(this);
}

std::optional<double> EnergyMeter::Account::joules() {
  const std::lock_guard lock(meter_.mutex_);
  meter_.share_out();
  return meter_.joules_.at(this);
}

}  // namespace qjulia::batch
