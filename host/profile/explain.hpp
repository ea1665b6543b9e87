#pragma once
/// What limits a kernel, in words.

#include <optional>
#include <string>
#include <vector>

#include "profile/roof.hpp"
#include "qjulia/profile/instruction_mix.hpp"

namespace qjulia::profiling {

/// The share of the multiply-adds that a loop can reach for its loads and stores, if the nearest
/// cache serves them all; 1 where that cache was not measured.
double load_ceiling(const InstructionMix& mix, const Roofs& roofs, bool is_double);

/// The share of the multiply-adds that its operations and its loads and stores allow; none without
/// a mix.
std::optional<double> ceiling_of(const InstructionMix* mix, const Roofs& roofs, bool is_double);

/// A run of a kernel or a job, and the device's limits beside it.
struct MeasuredRun {
  Spent spent;
  Roofs roofs;
};

/// The share that the runs reached of the limit that most of them had.
/// @param is_busy as in `judged`. @param mix null where it is not known.
JudgedShare judged_runs(const KernelWork& work, const std::vector<MeasuredRun>& runs, bool is_busy,
                        const InstructionMix* mix);

/// @param limit,verdict,share as KernelFigures has them. @param mix null where it is not known.
/// @param is_busy as in `judged`.
/// @return empty where nothing is known.
std::string limited_by(const KernelWork& work, const Spent& spent, const Roofs& roofs,
                       const std::string& limit, const std::string& verdict,
                       const std::optional<double>& share, const InstructionMix* mix, bool is_busy);

/// A line for each kernel that something limits.
/// @param kernels with the members kernel and limited_by.
template <class Kernels>
std::string limit_lines(const Kernels& kernels) {
  std::string text;
  for (const auto& kernel : kernels) {
    if (!kernel.limited_by.empty()) text += "\n" + kernel.kernel + ": " + kernel.limited_by;
  }
  return text.empty() ? text : "what limits each kernel" + text;
}

}  // namespace qjulia::profiling
