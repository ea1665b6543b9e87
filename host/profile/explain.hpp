#pragma once
/// What limits a kernel, in words.

#include <optional>
#include <string>
#include <vector>

#include "profile/roof.hpp"
#include "qjulia/device/launch_size.hpp"
#include "qjulia/profile/instruction_mix.hpp"
#include "qjulia/profile/processor_use.hpp"

namespace qjulia::profiling {

/// The share of the multiply-adds that a loop can reach for its loads and stores, if the nearest
/// cache serves them all; 1 where that cache was not measured.
double load_ceiling(const InstructionMix& mix, const Roofs& roofs, bool is_double);

/// What its operations and its loads and stores allow; none without a mix.
std::optional<CodeBounds> bounds_of(const InstructionMix* mix, const Roofs& roofs, bool is_double);

/// A run of a kernel or a job, and the device's limits beside it.
struct MeasuredRun {
  Spent spent;
  Roofs roofs;
};

/// The share that the runs reached of the limit that most of them had.
/// @param is_busy as in `judged`. @param mix null where it is not known.
JudgedShare judged_runs(const KernelWork& work, const std::vector<MeasuredRun>& runs, bool is_busy,
                        const InstructionMix* mix);

/// What a kernel's share was measured with.
struct Conditions {
  Roofs roofs;
  const InstructionMix* mix = nullptr;  ///< null where it is not known
  std::size_t runs = 0;                 ///< 0: a command ran it, between two measurements of limits
  std::optional<ProcessorUse> use{};    ///< of the processors, meanwhile
};

/// @return empty where nothing is known.
std::string limited_by(const KernelWork& work, const Spent& spent, const JudgedShare& judged,
                       const Conditions& with);

/// "992 factors x 20480 to 81920 points", "64 unknowns x 1024 points to 8 x 672 unknowns x 1024
/// points"; empty where nothing is known.
std::string size_text(const std::optional<LaunchSizes>& sizes);
/// "1 launch", "7 launches".
std::string launches_text(std::uint64_t launches);

/// A line for each kernel that something limits, with its launches and their sizes.
/// @param kernels with the members kernel, launches, sizes and limited_by.
template <class Kernels>
std::string limit_lines(const Kernels& kernels) {
  std::string text;
  for (const auto& kernel : kernels) {
    if (kernel.limited_by.empty()) continue;
    const std::string size = size_text(kernel.sizes);
    text += "\n" + kernel.kernel;
    if (!size.empty()) text += " (" + launches_text(kernel.launches) + " of " + size + ")";
    text += ": " + kernel.limited_by;
  }
  return text.empty() ? text : "what limits each kernel" + text;
}

}  // namespace qjulia::profiling
