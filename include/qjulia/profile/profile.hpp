#pragma once
/// How fast the kernels run on a device, against what the device can do.

#include <array>
#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "qjulia/base/progress.hpp"
#include "qjulia/device/device.hpp"
#include "qjulia/device/kernel_resources.hpp"
#include "qjulia/device/launch_size.hpp"
#include "qjulia/map/map.hpp"
#include "qjulia/mesh/mesh.hpp"
#include "qjulia/profile/cache_roof.hpp"
#include "qjulia/profile/instruction_mix.hpp"
#include "qjulia/profile/processor_use.hpp"

namespace qjulia {

/// The workload is fixed by these numbers: points uniform in [−1.5, 1.5]³, factors with centres
/// uniform in [−1, 1]³ and |exponent| in [0.01, 0.06], 57 % of them roots; no orbit ends early, no
/// sample is saturated or skipped.
struct ProfileOptions {
  std::uint64_t sample_points = 125'000;
  std::uint64_t factors = 331;
  int repeats = 5;  ///< timed runs of each kernel, after one that is not
  std::uint64_t seed = 1;
  Precision precision = Precision::single;
  std::optional<int> lane_width{};  ///< 1, 8 or 16; none: the device's own
  /// n of the jobs of several iterates, 2 to 16. None: 4, and 6 for pictures.
  std::optional<int> iterations{};
  /// Measured in place of the made-up map: jobs then have its factors, and points in its box.
  std::optional<Map> map{};
  /// What distances are measured to, in place of a sphere.
  std::optional<TriangleMesh> mesh{};
  /// Names of jobs and kernels, with * and ?. Empty: with a map all, else the eight jobs that every
  /// profile has.
  std::vector<std::string> kernels{};
  /// Names of jobs, with * and ?; "fit" stands for the jobs of a fit with one iterate. Empty: all
  /// of those that `kernels` allows. Rows of single kernels beside them.
  std::vector<std::string> jobs{};
  /// Wall seconds of the whole run. Jobs share what is left of them; one whose runs do not fit is
  /// left out. None: no limit.
  std::optional<double> time_limit{};
  /// Also rows of single kernels, what they need of the device and, on CPUs, the events of
  /// `kEventNames`: of one more run, in which launches wait for each other.
  bool counters = false;
  void validate() const;  ///< @throws InputError naming the option
};

/// What is counted in user mode, over all threads of the process. Stalls are cycles in which
/// nothing is issued, for want of instructions or of what these wait for; CPU seconds are those of
/// all threads.
inline constexpr std::array kEventNames{"cycles",           "instructions",    "cache_misses",
                                        "stalled_frontend", "stalled_backend", "cpu_seconds",
                                        "page_faults"};

/// What the device can do at most, measured by kernels that do nothing else.
struct DeviceLimits {
  double fma_per_second = 0;  ///< fused multiply-adds of one number each
  /// A multiply-add of every lane in every clock cycle of all cores, at the clock that the device
  /// reports; 0 where lanes are not known, as on GPUs. Cores with two units reach twice as much.
  double clock_fma_per_second = 0;
  double bytes_per_second = 0;  ///< read and written by a copy much larger than any cache
  double launch_seconds = 0;    ///< a kernel without work takes, from the call to its end
  /// In a CPU second of the threads that run kernels, where the device is a CPU; 0 elsewhere.
  double fma_per_cpu_second = 0;
  double bytes_per_cpu_second = 0;
};

/// One kernel, or the few kernels that do one job.
struct KernelFigures {
  std::string kernel;
  int iterations = 1;
  std::size_t samples = 0;
  std::size_t factors = 0;
  int width = 1;
  Precision precision = Precision::single;
  std::uint64_t launches = 0;          ///< of a run, where it is one kernel
  bool is_one_kernel = false;          ///< and not a job
  std::optional<LaunchSizes> sizes{};  ///< of its launches, where it is one kernel
  bool work_is_at_most = false;        ///< orbits may end before they have done all of it
  double median_seconds = 0;           ///< on the device
  double min_seconds = 0;
  double max_seconds = 0;
  double wall_seconds = 0;          ///< median, host time included
  std::vector<double> run_seconds;  ///< of every run, on the device
  /// Runs that were made again because other programs took the processors meanwhile.
  std::size_t runs_left_out = 0;
  /// The multiply-add limit, measured again after every run: other work, heat or a lower clock slow
  /// it down as they slow down the run.
  std::vector<double> run_fma_per_second;
  /// Where the device is a CPU: CPU seconds of the threads that run kernels, in every run, and the
  /// multiply-add limit in such a second, measured after it. Other programs make a run take longer,
  /// but do not change its CPU seconds. Empty on other devices.
  std::vector<double> run_cpu_seconds;
  std::vector<double> run_fma_per_cpu_second;
  /// Iterates × factors that were really computed in a run; none where orbits or rays end early.
  std::optional<double> executed_factor_iterations;
  std::optional<double> pairs_per_second;  ///< iterates × factors in a second of the median run
  /// Multiply-adds, multiplications and divisions in the kernel's source, one slot each, over all
  /// samples and factors.
  std::optional<double> slots;
  std::optional<double> memory_bytes;  ///< read and written at least
  std::string limit;  ///< "fma" or "memory", whichever is lower there; empty where not known
  /// The median over the runs of the share of what the device can do at this work per byte. A run's
  /// share is slots / (CPU seconds × multiply-adds in a CPU second), both of this run; where the
  /// device is no CPU, slots / (seconds × multiply-adds a second); and bytes / (seconds × bytes a
  /// second) where memory limits. None unless the verdict is "judged".
  std::optional<double> share_of_limit;
  /// The 90 % confidence interval of the median share; with fewer than five runs, the lowest and
  /// the highest share. Where the verdict is "not now", the shares that were seen.
  std::optional<double> share_low, share_high;
  /// "judged"; "not now": other programs disturb too much to judge it; "cached": it moved more
  /// bytes than memory can carry, so the data stayed in a cache; "ends early": orbits ended before
  /// the counted work was done; or empty where no work is known.
  std::string share_verdict;
  /// What the instructions of the compiled kernel and its memory traffic take at the device's
  /// limits, where they were counted: single precision, on GPUs.
  std::optional<double> predicted_seconds;
  std::map<std::string, double> events;      ///< those of `kEventNames` that could be counted
  std::optional<KernelResources> resources;  ///< of one kernel, where counters are wanted
  /// Of one kernel, on CPUs whose driver keeps its machine code as files.
  std::optional<InstructionMix> instructions;
  std::string limited_by;  ///< what limits one kernel, in words; empty where nothing is known

  /// How far apart the runs lie, over their median: 0 where all took as long.
  double spread() const { return (max_seconds - min_seconds) / median_seconds; }
  /// Mean number of processors at work: the median over the runs of CPU seconds over seconds.
  std::optional<double> processors() const;
};

struct ProfileReport {
  DeviceInfo device;
  Layout layout = Layout::cpu;
  Tuning tuning;          ///< the settings that were measured
  bool is_tuned = false;  ///< whether these are others than the device's defaults
  DeviceLimits limits;
  double fma_per_second_after = 0;  ///< the limit once more, when all kernels were timed
  std::vector<KernelFigures> kernels;
  std::vector<std::string> left_out;  ///< jobs that were not measured, and why
  /// The share of their time in which the threads that run kernels waited for a processor.
  std::optional<double> waited_share;
  std::optional<ProcessorUse> use{};     ///< of the processors, meanwhile
  bool has_counters = false;             ///< whether they were wanted
  std::vector<CacheRoof> caches;         ///< where single kernels were measured
  std::vector<std::string> not_counted;  ///< events that cannot be counted here, and why

  /// A line for each single kernel that says what limits it, under a heading; empty where nothing
  /// is known.
  std::string what_limits() const;
  /// Signs that other work disturbed the measurement, a sentence each; none on an idle machine.
  std::vector<std::string> disturbances() const;
};

/// Measures the device's limits, then each kernel.
ProfileReport profile(const Device& device, const ProfileOptions& options,
                      const ProgressMonitor& monitor = {});

/// Why there is no share, with the shares that were seen in per cent: "not now (54.1 to 58.0)"; "-"
/// where no work is known.
std::string verdict_text(const std::string& verdict, const std::optional<double>& low,
                         const std::optional<double>& high);

nlohmann::json to_json(const KernelFigures& figures);
nlohmann::json to_json(const ProfileReport& report);
/// A line for each kernel, as in JSON, under a line of names; empty where nothing is known.
std::string to_csv(const ProfileReport& report);

/// What has become slower than in an earlier report (as JSON) by more than `tolerance` (0.1: 10 %):
/// a line for each kernel. Kernels of other sizes, widths or precisions are not compared.
/// @throws InputError when the baseline is no report, or nothing in it can be compared.
std::vector<std::string> regressions(const ProfileReport& report, const nlohmann::json& baseline,
                                     double tolerance);

}  // namespace qjulia
