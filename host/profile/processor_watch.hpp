#pragma once
/// Who else has the processors, as Linux counts it.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "qjulia/profile/processor_use.hpp"

namespace qjulia::profiling {

/// Watches from its making on.
class ProcessorWatch {
 public:
  /// @param root of the file system: where /proc and /sys are.
  explicit ProcessorWatch(const std::filesystem::path& root = "/");
  /// None where the system does not say.
  std::optional<ProcessorUse> so_far() const;

 private:
  struct Reading {
    double wall = 0, own = 0;  ///< seconds
    double busy = 0, stolen = 0;
    int processors = 0;
    std::uint64_t throttled_times = 0;
    double throttled_seconds = 0;
  };
  std::optional<Reading> read() const;

  std::filesystem::path root_;
  std::vector<std::filesystem::path> groups_;  ///< cpu.stat of this process's control group
  std::optional<Reading> before_;
};

/// What kept this program from the processors, a few words each, such as "other programs had 1.2 of
/// 2 processors"; none where nothing did, or nothing is known.
std::vector<std::string> reasons(const ProcessorUse& use);

}  // namespace qjulia::profiling
