#include "qjulia/profile.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>

#include "base/range_check.hpp"
#include "device/point_batch.hpp"
#include "energy/evaluator.hpp"
#include "profile/cost.hpp"
#include "profile/instruction_counts.hpp"
#include "profile/workload.hpp"
#include "qjulia/error.hpp"
#include "qjulia/field.hpp"
#include "qjulia/picture.hpp"
#include "qjulia/shape.hpp"
#include "surface/level_set.hpp"

namespace qjulia {

using namespace profiling;
namespace {

/// Seconds on the device: the fastest of `repeats` runs, after one that is not counted.
double least_seconds(const Device& device, int repeats, const std::function<void()>& run) {
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i <= repeats; ++i) {
    const KernelSeconds seconds = timed(device, run);
    if (i > 0) least = std::min(least, seconds.device);
  }
  return least;
}

/// Fused multiply-adds a second, by one run of a kernel that does nothing else.
std::function<double()> fma_probe(const Device& device, Precision precision) {
  constexpr double kChains = 16;  // QJ_CHAINS of limits.cl
  device::Context& context = device.context();
  const int width = device.lane_width(precision);
  // Lanes on CPUs come from the vector, on GPUs from very many work-items.
  const std::size_t items = width == 1 ? std::size_t{1} << 18 : 256;
  const int rounds = width == 1 ? 2048 : 40'000;
  const auto seed = context.upload_real(std::array{0.999, 0.001}, precision);
  const auto sums = context.allocate_real(items, precision);
  return [=, &context] {
    const KernelSeconds seconds = timed(device, [&] {
      context.launch(context.kernel("limits.cl", "fma_chains", {width, precision, {}}),
                     {{items, 1, 1}}, {seed, rounds, sums});
    });
    return kChains * rounds * static_cast<double>(items) * width / seconds.device;
  };
}

/// Of the best of `repeats` runs, after one that is not counted: a limit is what was reached at
/// least once.
double measure_fma(const Device& device, Precision precision, int repeats) {
  const auto probe = fma_probe(device, precision);
  probe();
  double best = 0;
  for (int i = 0; i < repeats; ++i) best = std::max(best, probe());
  return best;
}

/// All limits, each of the best of so many runs.
DeviceLimits measure_limits(const Device& device, Precision precision, int repeats) {
  device::Context& context = device.context();
  const int width = device.lane_width(precision);
  const auto lanes = static_cast<std::size_t>(width);
  const auto kernel = [&](const char* name) {
    return context.kernel("limits.cl", name, {width, precision, {}});
  };
  const DeviceInfo& info = context.info();
  DeviceLimits limits;
  limits.fma_per_second = measure_fma(device, precision, repeats);
  if (width > 1) {
    constexpr double kMega = 1e6;
    limits.clock_fma_per_second = kMega * info.clock_mhz * info.compute_units * width;
  }

  constexpr std::size_t kCopyBytes = std::size_t{1} << 28;  // 256 MiB
  const std::size_t real_bytes = device::real_bytes(precision);
  const std::size_t reals =
      std::min<std::size_t>(kCopyBytes, info.largest_allocation / 4) / real_bytes;
  const std::size_t vectors = width == 1 ? 1 : 256;
  const std::size_t copy_items = reals / (vectors * lanes);
  const auto from = context.allocate_real(reals, precision);
  const auto to = context.allocate_real(reals, precision);
  const double copy_seconds = least_seconds(device, repeats, [&] {
    context.launch(kernel("copy_reals"), {{copy_items, 1, 1}},
                   {from, device::narrow(vectors), device::narrow(copy_items), to});
  });
  limits.bytes_per_second =
      2 * static_cast<double>(copy_items * vectors * lanes * real_bytes) / copy_seconds;

  limits.launch_seconds = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 20 * repeats; ++i) {
    const auto run = timed(device, [&] { context.launch(kernel("no_work"), {{1, 1, 1}}, {from}); });
    limits.launch_seconds = std::min(limits.launch_seconds, run.wall);
  }
  return limits;
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

/// What a job asks for, where that is known.
struct Cost {
  double slots = 0;  ///< for one factor at one sample (cost.hpp)
  double reals = 0;  ///< in the whole job
};

/// Collects figures, one job after the other.
class Bench {
 public:
  Bench(const Device& device, const ProfileOptions& options, const DeviceLimits& limits,
        const ProgressMonitor& monitor, int jobs)
      : device_(device),
        options_(options),
        limits_(limits),
        monitor_(monitor),
        jobs_(jobs),
        limit_now_(fma_probe(device, options.precision)) {}

  /// Times `work` over `samples`. `iterates`: factor iterations a sample and factor that really
  /// run, 0 where that is not known.
  void time(const std::string& kernel, int n, std::size_t samples, double iterates,
            const Cost& cost, const std::function<void()>& work) {
    monitor_.report({"profiling", static_cast<double>(figures_.size()) / jobs_, -1,
                     fmt::format("{}, n = {}", kernel, n)});
    work();  // builds the kernels, fills the caches
    std::vector<double> seconds, wall, limits_beside;
    for (int i = 0; i < options_.repeats; ++i) {
      throw_if_stopped(monitor_.stop);
      const KernelSeconds run = timed(device_, work);
      seconds.push_back(run.device);
      wall.push_back(run.wall);
      limits_beside.push_back(limit_now_());
    }
    KernelFigures f;
    f.kernel = kernel;
    f.iterations = n;
    f.samples = samples;
    f.factors = options_.factors;
    f.width = device_.lane_width(options_.precision);
    f.precision = options_.precision;
    f.median_seconds = median(seconds);
    f.min_seconds = std::ranges::min(seconds);
    f.max_seconds = std::ranges::max(seconds);
    f.wall_seconds = median(wall);
    f.run_seconds = std::move(seconds);
    f.run_fma_per_second = std::move(limits_beside);
    const double pairs = static_cast<double>(samples) * static_cast<double>(options_.factors);
    if (iterates > 0) {
      f.executed_factor_iterations = pairs * iterates;
      f.pairs_per_second = pairs * iterates / f.median_seconds;
    }
    if (cost.slots > 0) {
      f.slots = pairs * cost.slots;
      f.memory_bytes = static_cast<double>(device::real_bytes(f.precision)) * cost.reals;
      const double by_memory = *f.slots / *f.memory_bytes * limits_.bytes_per_second;
      f.limit = by_memory < limits_.fma_per_second ? "memory" : "fma";
      f.share_of_limit = *f.slots / f.median_seconds / std::min(by_memory, limits_.fma_per_second);
    }
    f.predicted_seconds = predicted_seconds(f);
    figures_.push_back(std::move(f));
  }

  std::vector<KernelFigures> figures() && { return std::move(figures_); }

 private:
  std::optional<double> predicted_seconds(const KernelFigures& f) const {
    if (f.precision == Precision::dbl) return std::nullopt;
    const int before = f.iterations - 1;
    int slots_a_pair = 0;
    if (f.kernel == "energy") {
      slots_a_pair = before * slots(kStep) + slots(kLogNorm);
    } else if (f.kernel == "gradient" && f.iterations == 1) {
      slots_a_pair = slots(kLogNorm) + slots(kPotentialGradient);
    } else if (f.kernel == "gradient") {
      slots_a_pair =
          before * (slots(kStep) + slots(kPullBack)) + slots(kLogNorm) + slots(kPullBackLast);
    } else {
      return std::nullopt;
    }
    const double pairs = static_cast<double>(f.samples) * static_cast<double>(f.factors);
    return std::max(pairs * slots_a_pair / limits_.fma_per_second,
                    f.memory_bytes.value_or(0) / limits_.bytes_per_second);
  }

  Device device_;
  const ProfileOptions& options_;
  const DeviceLimits& limits_;
  const ProgressMonitor& monitor_;
  int jobs_;
  std::function<double()> limit_now_;
  std::vector<KernelFigures> figures_;
};

/// Iterates that run of each sample's n, on average: all of them, unless an orbit escapes.
double executed_iterates(const Device& device, const Workload& work, int n, Precision precision) {
  const Field field(device, work.map, precision, {0, 0, kNoEscape});
  const auto points = on_slice(work.samples.position, work.map.dynamics.slice);
  std::size_t executed = points.size();
  for (int m = 1; m < n; ++m) {
    executed += static_cast<std::size_t>(std::ranges::count_if(
        field.at(points, m), [](double f) { return f < std::log(kNoEscape); }));
  }
  return static_cast<double>(executed) / static_cast<double>(points.size());
}

void time_evaluator(Bench& bench, const Device& device, const Workload& work, int n,
                    Precision precision) {
  const auto evaluator = make_evaluator(device, work, n, precision);
  const double iterates = executed_iterates(device, work, n, precision);
  const std::size_t samples = work.samples.size();
  const auto count = static_cast<double>(samples);
  const double energy_reals = cost::kEnergyReals * count;
  const double gradient_reals = energy_reals + (n == 1 ? cost::kPotentialGradientReals * count : 0);
  bench.time("energy", n, samples, iterates, {cost::energy(n), energy_reals},
             [&] { evaluator->evaluate(work.map, false); });
  bench.time("gradient", n, samples, iterates, {cost::gradient(n), gradient_reals},
             [&] { evaluator->evaluate(work.map, true); });
}

/// H = JᵀWJ, in multiply-adds of its upper triangle.
void time_gauss_newton(Bench& bench, const Device& device, Workload work, Precision precision) {
  const std::size_t samples = std::min<std::size_t>(
      work.samples.size(), energy::curvature_samples(1 + 5 * work.map.dynamics.factors.size()));
  energy::Samples part;
  for (std::size_t i = 0; i < samples; ++i) part.add(work.samples, i);
  const auto evaluator = energy::make_device_evaluator(device, part, {}, precision);
  const double order = 1 + 5 * static_cast<double>(work.map.dynamics.factors.size());
  const double slots =
      0.5 * order * (order + 1) / static_cast<double>(work.map.dynamics.factors.size());
  const double reals = cost::gauss_newton_reals(static_cast<double>(samples), order,
                                                device.tuning(precision).panel_samples);
  bench.time("gauss_newton", 1, samples, 1, {slots, reals},
             [&] { evaluator->gauss_newton(work.map); });
}

void time_surface_and_picture(Bench& bench, const Device& device, const Workload& work,
                              Precision precision) {
  const int side =
      static_cast<int>(std::lround(std::cbrt(static_cast<double>(work.samples.size()))));
  surface::Grid grid{Eigen::Vector3d::Constant(-1.5), 3.0 / side, {side, side, side}};
  const auto points = static_cast<std::size_t>(side) * static_cast<std::size_t>(side) *
                      static_cast<std::size_t>(side);
  const surface::LevelSet level_set(device, work.map, {0, 0, kNoEscape}, 4, precision);
  const Cost cost{cost::energy(4), cost::level_set_reals(4) * static_cast<double>(points)};
  bench.time("level_set", 4, points, 4, cost, [&] {
    level_set.over(grid, {{0, 0, 0}, grid.points});
  });

  // A root at the origin makes the set bounded, and a ball in the main.
  Map ball = work.map;
  ball.dynamics.factors.front() = {{0, 0, 0, 0}, 4};
  PictureOptions picture;
  picture.width = 160;
  picture.height = 120;
  constexpr std::size_t kRays = std::size_t{160} * 120;
  picture.samples_per_axis = 1;
  picture.precision = precision;
  bench.time("ray_march", picture.iterations, kRays, 0, {}, [&] { render(device, ball, picture); });
}

}  // namespace

void ProfileOptions::validate() const {
  base::expect_between("samples", samples, 64, 100'000'000);
  base::expect_between("factors", factors, 8, 20'000);
  base::expect_between("repeats", repeats, 1, 1000);
  if (lane_width && *lane_width != 1 && *lane_width != 8 && *lane_width != 16) {
    throw OptionError("lane_width",
                      fmt::format("{} is out of range; give 1, 8 or 16", *lane_width));
  }
}

ProfileReport profile(const Device& chosen, const ProfileOptions& options,
                      const ProgressMonitor& monitor) {
  options.validate();
  const Device device = options.lane_width ? chosen.with_lane_width(*options.lane_width) : chosen;
  ProfileReport report;
  report.device = device.info();
  report.layout = device.layout();
  report.tuning = device.tuning(options.precision);
  report.is_tuned = device.is_tuned(options.precision);
  monitor.report({"profiling", 0, -1, "limits of the device"});
  report.limits = measure_limits(device, options.precision, options.repeats);

  constexpr int kJobs = 8;
  Bench bench(device, options, report.limits, monitor, kJobs);
  const Workload work = make_workload(options);
  for (const int n : {1, 4}) time_evaluator(bench, device, work, n, options.precision);
  time_gauss_newton(bench, device, work, options.precision);

  constexpr int kRings = 72;
  const SignedDistance distance(device, make_sphere(kRings), options.precision);
  bench.time("distance", 1, work.samples.size(), 0, {},
             [&] { distance.at(work.samples.position); });
  time_surface_and_picture(bench, device, work, options.precision);
  report.kernels = std::move(bench).figures();
  report.fma_per_second_after = measure_fma(device, options.precision, options.repeats);
  monitor.report({"profiling", 1, 0, ""});
  return report;
}

}  // namespace qjulia
