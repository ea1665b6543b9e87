#pragma once
/// Whether one profile's kernels are slower than another's.

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "benchmark/ratio_bounds.hpp"

namespace qjulia::benchmark {

/// What two profiles may differ in.
enum class Across {
  builds,   ///< the program's build alone
  drivers,  ///< also the driver, and the names that drivers give one device
  devices   ///< also device and settings
};
std::string to_string(Across across);

struct ComparisonOptions {
  /// The probability, for all kernels together, that no kernel is wrongly called slower, and
  /// likewise for faster. Above ½ and below 1.
  double confidence = 0.95;
  double tolerance = 0.02;  ///< a kernel is slower if it takes longer by more than this share
  Across across = Across::builds;
  void validate() const;  ///< @throws InputError
};

/// The clock in whose seconds times are counted.
enum class Clock {
  device,  ///< seconds of the device's own clock
  cpu      ///< CPU seconds of the threads that run kernels: used when the machine is busy
};
std::string to_string(Clock clock);

enum class Verdict { same, faster, slower, undecided };
std::string to_string(Verdict verdict);

/// @throws InputError where it is what a command wrote for --profile, which has no runs to compare.
/// @param name of the report.
void expect_measured(const nlohmann::json& report, const std::string& name);

struct KernelComparison {
  std::string kernel;
  int iterations = 1;
  double before_seconds = 0;  ///< median, by the comparison's clock
  double after_seconds = 0;
  /// The ratio of the times, each multiplied by the limit that was measured beside it; none where
  /// there are too few runs for the confidence.
  std::optional<RatioBounds> ratio;
  Verdict verdict = Verdict::same;
};

struct ProfileComparison {
  /// What was compared with what: builds of one driver, drivers of one device, or devices.
  Across between = Across::builds;
  Clock clock = Clock::device;
  std::vector<KernelComparison> kernels;
  /// What differs besides the build, a sentence each.
  std::vector<std::string> differences;
  std::vector<std::string> busy;  ///< signs that other work disturbed a profile, a sentence each
  std::vector<std::string> left_out;  ///< kernels that one profile alone has
  /// Slower if any kernel is; else undecided if any is.
  Verdict verdict = Verdict::same;
};

/// Compares the runs that two profiles keep, kernel by kernel: seconds of the device's clock or,
/// where other work disturbed either of two profiles of one CPU, its CPU seconds. These leave out
/// how well the work is spread over processors. Where these are disturbed too, or not known,
/// kernels are not called slower: they are undecided unless they are clearly no slower.
/// @param before, after the JSON of `qjulia profile measure`.
/// @throws InputError: not such JSON, or without runs; another device, driver, layout, width,
///   precision or tuning (unless `across` allows it); other sizes of the work; nothing in common;
///   too few runs for the confidence. The message names the profile, and says what to do.
ProfileComparison compare_profiles(const nlohmann::json& before, const nlohmann::json& after,
                                   const ComparisonOptions& options);

nlohmann::json to_json(const ProfileComparison& comparison);

}  // namespace qjulia::benchmark
