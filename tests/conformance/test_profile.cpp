// The profile: its work is what it says, and a slower kernel is found.

#include <algorithm>
#include <array>
#include <catch2/catch_all.hpp>
#include <cmath>
#include <ctime>
#include <nlohmann/json.hpp>
#include <set>
#include <thread>

#include "energy/cost.hpp"
#include "energy/evaluator.hpp"
#include "profile/code_sampler.hpp"
#include "profile/instruction_counts.hpp"
#include "profile/kernel_counter.hpp"
#include "profile/limits.hpp"
#include "profile/prediction.hpp"
#include "profile/work_counter.hpp"
#include "profile/worker_clock.hpp"
#include "profile/workload.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/profile/own_launch.hpp"
#include "qjulia/profile/profile.hpp"
#include "qjulia/profile/scaling.hpp"
#include "report/roofline.hpp"
#include "test_device.hpp"

using namespace qjulia;
using namespace qjulia::report;

namespace {

ProfileOptions small() {
  ProfileOptions options;
  options.sample_points = 3000;
  options.factors = 40;
  options.repeats = 2;
  return options;
}

const ProfileReport& measured() {
  static const ProfileReport made = profile(test::shared_device(), small());
  return made;
}

const KernelFigures& figures(std::string_view kernel, int n) {
  const auto found = std::ranges::find_if(
      measured().kernels, [&](const auto& f) { return f.kernel == kernel && f.iterations == n; });
  REQUIRE(found != measured().kernels.end());
  return *found;
}

}  // namespace

TEST_CASE("the workload is the one described") {
  const profiling::Workload work = profiling::make_workload(small());
  REQUIRE(work.samples.size() == 3000);
  REQUIRE(work.map.dynamics.factors.size() == 40);
  std::size_t roots = 0;
  for (const Factor& f : work.map.dynamics.factors) {
    roots += f.exponent > 0 ? 1 : 0;
    CHECK(std::abs(f.exponent) >= 0.01);
    CHECK(std::abs(f.exponent) <= 0.06);
  }
  CHECK(roots == 23);  // 57 % of 40, rounded up
  for (const auto& x : work.samples.position) CHECK(x.cwiseAbs().maxCoeff() <= 1.5);
}

TEST_CASE("energy and gradient run every iterate of every sample") {
  for (const int n : {1, 4}) {
    for (const char* kernel : {"energy", "gradient"}) {
      const KernelFigures& f = figures(kernel, n);
      CHECK(f.executed_factor_iterations == 3000.0 * 40 * n);
      CHECK(f.pairs_per_second == Catch::Approx(3000.0 * 40 * n / f.median_seconds));
      CHECK(f.min_seconds > 0);
      // Kernels run within the wall clock's time.
      CHECK(f.min_seconds <= f.wall_seconds);
      CHECK(f.limit == "fma");
    }
  }
  for (const char* kernel : {"gauss_newton", "distance", "level_set", "ray_march"}) {
    CHECK(std::ranges::count(measured().kernels, kernel, &KernelFigures::kernel) == 1);
  }
}

TEST_CASE("every share is judged or has a reason why not, and none is above 1") {
  const bool is_cpu = test::shared_device().info().kind == DeviceKind::cpu;
  for (const KernelFigures& f : measured().kernels) {
    CAPTURE(f.kernel, f.iterations, f.share_verdict);
    CHECK(f.slots.has_value() == !f.share_verdict.empty());
    CHECK(f.share_of_limit.has_value() == (f.share_verdict == "judged"));
    CHECK(f.run_cpu_seconds.size() == (is_cpu ? f.run_seconds.size() : 0));
    CHECK(f.run_fma_per_cpu_second.size() == f.run_cpu_seconds.size());
    CHECK(f.processors().has_value() == is_cpu);
    if (!f.share_of_limit) continue;
    CHECK(*f.share_low > 0);
    CHECK(*f.share_low <= *f.share_of_limit);
    CHECK(*f.share_of_limit <= *f.share_high);
    CHECK(*f.share_high <= 1);
    if (!is_cpu || f.limit != "fma") continue;
    std::vector<double> shares;
    for (std::size_t i = 0; i < f.run_cpu_seconds.size(); ++i) {
      shares.push_back(*f.slots / f.run_cpu_seconds[i] / f.run_fma_per_cpu_second[i]);
    }
    if (shares.size() != 2) continue;     // runs are repeated where the machine is busy
    if (*f.share_low == *f.share_high) {  // the other run was nearer to the limit of memory
      CHECK((*f.share_low == Catch::Approx(shares[0]) || *f.share_low == Catch::Approx(shares[1])));
      continue;
    }
    CHECK(*f.share_low == Catch::Approx(std::min(shares[0], shares[1])));
    CHECK(*f.share_of_limit == Catch::Approx(std::min(1.0, std::sqrt(shares[0] * shares[1]))));
  }
}

TEST_CASE("a gradient's work counts only the samples that it uses") {
  const profiling::Workload work = profiling::make_workload(small());
  energy::Samples samples = work.samples;
  for (std::size_t i = 0; i < 1000; ++i) samples.weight[i] = 0;  // their cotangent is 0
  const auto evaluator = energy::make_device_evaluator(
      test::shared_device(), samples, {.escape = profiling::kNoEscape}, Precision::single);
  profiling::WorkCounter counter;
  const energy::Evaluation unwatched = evaluator->evaluate(work.map, true);
  {
    const device::WatchedLaunches watched(counter);
    const energy::Evaluation seen = evaluator->evaluate(work.map, true);
    CHECK(seen.energy == unwatched.energy);
    CHECK(seen.gradient == unwatched.gradient);
  }
  const profiling::KernelWork& done = counter.work().at("gradient_potential");
  CHECK(done.slots == 2000 * 40 * cost::kPotentialGradient);
  CHECK_FALSE(done.at_most);
  REQUIRE(done.sizes);
  CHECK(done.sizes->most.terms == 40);
  CHECK(done.sizes->most.points >= 3000);  // whole vectors
}

TEST_CASE("the jobs of a fit are measured alone, with rows of their kernels and one verdict") {
  ProfileOptions options = small();
  options.jobs = {"fit"};
  options.kernels = {"energy*", "panel_products*"};
  const ProfileReport report = profile(test::shared_device(), options);
  std::set<std::string> names;
  for (const KernelFigures& f : report.kernels) {
    names.insert(f.kernel);
    CHECK(f.iterations == 1);
    CHECK(f.sizes.has_value() == f.is_one_kernel);
  }
  CHECK(names.contains("energy"));
  CHECK(names.contains("energy_terms"));
  CHECK(names.size() == 3);  // and the products, whichever kernel makes them here
  // The job has one kernel, and the same runs.
  CHECK(report.kernels[0].share_verdict == report.kernels[1].share_verdict);
  options.jobs = {"fits"};
  CHECK_THROWS_AS(profile(test::shared_device(), options), OptionError);
}

TEST_CASE("CPU seconds are those of the threads that run kernels, and not of others") {
  const Device& device = test::shared_device();
  const profiling::WorkerClockPointer clock = profiling::worker_clock(device);
  REQUIRE((clock != nullptr) == (device.info().kind == DeviceKind::cpu));
  if (!clock) return;  // no thread of this process runs kernels
  ProfileOptions options;
  options.sample_points = 20'000;
  const profiling::Workload work = profiling::make_workload(options);
  profiling::TuneBench bench(device, work, Precision::single);
  bench.run(profiling::TuneJob::orbit_energy);
  const auto seconds_of = [](clockid_t id) {
    timespec time{};
    REQUIRE(::clock_gettime(id, &time) == 0);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
  };
  // Two other threads of this process are busy meanwhile.
  std::array<double, 2> others{};
  profiling::KernelsRun run;
  const double before = seconds_of(CLOCK_PROCESS_CPUTIME_ID);
  {
    std::vector<std::jthread> busy;
    for (double& used : others) {
      busy.emplace_back([&](const std::stop_token& end) {
        volatile double sum = 0;
        while (!end.stop_requested()) sum = sum + 1;
        used = seconds_of(CLOCK_THREAD_CPUTIME_ID);
      });
    }
    run = profiling::timed_by_kernel(device, clock, [&] {
      for (int i = 0; i < 5; ++i) bench.run(profiling::TuneJob::orbit_energy);
    });
  }
  const double all = seconds_of(CLOCK_PROCESS_CPUTIME_ID) - before;
  const double rest = all - others[0] - others[1];
  CHECK(run.all.cpu_seconds > 0.5 * rest);
  CHECK(run.all.cpu_seconds < 1.1 * rest);
  CHECK(run.kernels.at("energy_terms").spent.cpu_seconds > 0.5 * run.all.cpu_seconds);
  const profiling::WaitedShare waited(clock);
  bench.run(profiling::TuneJob::orbit_energy);
  if (const auto share = waited.so_far()) CHECK((*share >= 0 && *share < 1));
}

TEST_CASE("threads are seen in the kernel that they run, by one sampler at a time") {
  const Device& device = test::shared_device();
  const profiling::WorkerClockPointer clock = profiling::worker_clock(device);
  CHECK_FALSE(profiling::CodeSampler(nullptr).is_sampling());
  CHECK(profiling::CodeSampler(nullptr).mixes().mixes.empty());
  const bool keeps_files = device.info().platform_name == "Portable Computing Language";
  if (!clock || !keeps_files) return;
  ProfileOptions options;
  options.sample_points = 20'000;
  const profiling::Workload work = profiling::make_workload(options);
  profiling::TuneBench bench(device, work, Precision::single);
  bench.run(profiling::TuneJob::energy);
  const profiling::CodeSampler sampler(clock);
  if (!sampler.is_sampling()) return;  // another processor than x86-64
  const profiling::CodeSampler second(clock);
  CHECK_FALSE(second.is_sampling());
  const double before = clock->seconds();
  while (clock->seconds() - before < 1) bench.run(profiling::TuneJob::energy);
  CHECK(second.mixes().mixes.empty());
  const profiling::KernelMixes found = sampler.mixes();
  CHECK(found.sees_kernels);
  INFO(found.problem);
  REQUIRE(found.mixes.contains("energy_terms"));
  const InstructionMix& mix = found.mixes.at("energy_terms");
  CHECK(mix.time_share > 0.5);
  CHECK(mix.slots() > 0);
  CHECK(mix.loads > 0);
}

TEST_CASE("the roofline has its two roofs and every kernel whose share can be judged") {
  ProfileReport shown = measured();
  std::size_t known = 0;
  for (KernelFigures& f : shown.kernels) {
    if (!f.slots) continue;
    // As on an idle machine, except that the first share could not be judged.
    f.share_of_limit = f.share_low = f.share_high = 0.1 * static_cast<double>(known);
    if (known++ == 0) f.share_of_limit.reset();
  }
  const Plot plot = roofline(shown);
  REQUIRE(plot.series.size() == 3);
  const PlotSeries& slope = plot.series[0];
  const PlotSeries& roof = plot.series[1];
  const PlotSeries& kernels = plot.series[2];
  // Both roofs meet where the work per byte is what the device can do of both.
  CHECK(slope.x.back() == roof.x.front());
  CHECK(slope.y.back() == Catch::Approx(roof.y.front()));
  CHECK(slope.y.front() / slope.x.front() == Catch::Approx(slope.y.back() / slope.x.back()));
  CHECK(slope.y.back() * 1e9 == Catch::Approx(measured().limits.fma_per_second));
  CHECK(slope.x.back() * measured().limits.bytes_per_second ==
        Catch::Approx(measured().limits.fma_per_second));
  CHECK(known == 6);  // energy and gradient twice, Gauss-Newton, level set
  REQUIRE(kernels.names.size() == 5);
  std::size_t i = 0;
  for (const KernelFigures& f : shown.kernels) {
    if (!f.slots || !f.share_of_limit) continue;
    CHECK(kernels.x[i] == Catch::Approx(*f.slots / *f.memory_bytes));
    const double allowed = std::min(roof.y[0], kernels.x[i] * slope.y.back() / slope.x.back());
    CHECK(*f.share_of_limit == Catch::Approx(kernels.y[i] / allowed));
    ++i;
  }
  CHECK_NOTHROW(draw_plot(plot));

  const KernelFigures& energy = figures("energy", 1);
  CHECK(energy.slots == 3000.0 * 40 * 13);  // |d|², the logarithm, the term
  CHECK(energy.memory_bytes == 3000.0 * 9 * 4);
}

TEST_CASE("predictions are what counted instructions take at the measured limits") {
  const KernelFigures& energy = figures("energy", 1);
  const DeviceLimits& limits = measured().limits;
  const double by_slots =
      3000.0 * 40 * profiling::slots(profiling::kLogNorm) / limits.fma_per_second;
  const double by_memory = 3000.0 * 8 * 4 / limits.bytes_per_second;
  const auto predicted = profiling::predicted_seconds(energy, limits);
  REQUIRE(predicted);
  CHECK(*predicted == Catch::Approx(std::max(by_slots, by_memory)));
  CHECK_FALSE(profiling::predicted_seconds(figures("distance", 1), limits));
  // What instructions of GPUs take says nothing of CPUs.
  const bool is_gpu = test::shared_device().info().kind == DeviceKind::gpu;
  CHECK(energy.predicted_seconds.has_value() == is_gpu);
}

TEST_CASE(
    "a profile with counters has rows of kernels, and what drivers and processors say of them") {
  ProfileOptions options = small();
  options.counters = true;
  options.kernels = {"energy*"};
  options.repeats = 1;
  const ProfileReport report = profile(test::shared_device(), options);
  const auto kernel = std::ranges::find(report.kernels, "energy_terms", &KernelFigures::kernel);
  REQUIRE(kernel != report.kernels.end());
  REQUIRE(kernel->resources);
  CHECK(kernel->resources->group_size >= 1);
  CHECK(kernel->resources->group_multiple >= 1);
  for (const KernelFigures& f : report.kernels) {
    CAPTURE(f.kernel);
    CHECK(f.is_one_kernel == f.resources.has_value());
    for (const char* name : kEventNames) {
      const auto says = [&](const std::string& line) {
        return line.find(name) != std::string::npos || line.starts_with("events:");
      };
      CAPTURE(name);
      CHECK(f.events.contains(name) != std::ranges::any_of(report.not_counted, says));
    }
  }
  CHECK(to_json(report)["not_counted"].size() == report.not_counted.size());
  CHECK(measured().kernels.front().events.empty());
  CHECK(measured().not_counted.empty());
}

TEST_CASE("every kernel that a fit, a surface and a picture launch says its work") {
  ProfileOptions options = small();
  options.repeats = 1;
  options.kernels = {"*"};
  const ProfileReport report = profile(test::shared_device(), options);
  std::size_t kernels = 0;
  for (const KernelFigures& f : report.kernels) {
    if (!f.is_one_kernel) continue;
    CAPTURE(f.kernel);
    CHECK(f.memory_bytes.has_value());
    ++kernels;
  }
  CHECK(kernels > 30);
}

TEST_CASE("kernels of a preconditioner are counted by what their blocks take") {
  const Layout layout = GENERATE(Layout::cpu, Layout::gpu);
  const Device device = test::shared_device().with_layout(layout);
  ProfileOptions options = small();
  options.factors = 200;
  options.repeats = 1;
  options.kernels = {"coarse_panels"};
  const ProfileReport report = profile(device, options);
  const auto slots = [&](const std::string& name) {
    const auto kernel = std::ranges::find(report.kernels, name, &KernelFigures::kernel);
    REQUIRE(kernel != report.kernels.end());
    return kernel->slots.value_or(0);
  };
  // Two blocks of 100 factors, padded to 112: 560 columns; samples in whole chunks.
  constexpr double kBlocks = 2, kColumns = 560;
  const double chunk = device.tuning(Precision::single).panel_samples;
  const double samples = std::ceil(static_cast<double>(options.sample_points) / chunk) * chunk;
  CHECK(slots("coarse_panels") == kBlocks * samples * kColumns);
}

TEST_CASE("events are those of the threads that run kernels") {
  const Device& device = test::shared_device();
  ProfileOptions options;
  options.sample_points = 20'000;
  if (device.info().kind != DeviceKind::cpu) {
    options.counters = true;
    options.kernels = {"energy_terms"};
    options.repeats = 1;
    const auto refused = profile(device, options).not_counted;
    const auto is_about_events = [](const std::string& line) {
      return line.starts_with("events:");
    };
    CHECK(std::ranges::any_of(refused, is_about_events));
    return;
  }
  const profiling::Workload work = profiling::make_workload(options);
  profiling::TuneBench bench(device, work, Precision::single);
  bench.run(profiling::TuneJob::energy);
  profiling::ProcessEvents events(profiling::system_event_calls());
  profiling::KernelCounter counter(&events);
  const device::WatchedLaunches watched(counter);
  const auto cpu_seconds = [] {
    timespec time{};
    REQUIRE(::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time) == 0);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
  };
  const double before = cpu_seconds();
  for (int i = 0; i < 10; ++i) bench.run(profiling::TuneJob::orbit_energy);
  const double all = cpu_seconds() - before;
  const auto counted = counter.kernels().at("energy_terms").events;
  const auto found = counted.find("cpu_seconds");
  if (found == counted.end()) {
    CHECK_FALSE(events.refused().empty());
    return;
  }
  CHECK(found->second < 1.5 * all);  // two clocks; counted twice it is 2
  CHECK(found->second > 0.5 * all);
}

TEST_CASE("the spread of the runs and the limit before and after are told") {
  for (const KernelFigures& f : measured().kernels) {
    CHECK(f.min_seconds <= f.median_seconds);
    CHECK(f.median_seconds <= f.max_seconds);
  }
  CHECK(measured().fma_per_second_after > 0);
  ProfileReport idle;
  idle.device.clock_mhz = 2000;
  idle.limits = {1e11, 3.2e10, 1e10, 1e-5};
  idle.fma_per_second_after = 1.02e11;
  idle.kernels.resize(1);
  KernelFigures& f = idle.kernels.front();
  f.kernel = "energy";
  f.min_seconds = 0.010, f.median_seconds = 0.011, f.max_seconds = 0.012;
  CHECK(f.spread() == Catch::Approx(2.0 / 11));
  CHECK(idle.disturbances().empty());
  const auto sign_of = [&](const auto& disturb) {
    ProfileReport report = idle;
    disturb(report);
    const auto signs = report.disturbances();
    REQUIRE(signs.size() == 1);
    CHECK(to_json(report)["disturbances"].size() == 1);
    return signs.front();
  };
  CHECK_THAT(sign_of([](auto& r) { r.kernels.front().max_seconds = 0.016; }),
             Catch::Matchers::ContainsSubstring("energy, n = 1, lie 55 % apart"));
  CHECK_THAT(sign_of([](auto& r) { r.fma_per_second_after = 0.9e11; }),
             Catch::Matchers::ContainsSubstring("100.0 G/s before and 90.0 after"));
  CHECK_THAT(sign_of([](auto& r) { r.waited_share = 0.3; }),
             Catch::Matchers::ContainsSubstring("waited for a processor for 30 %"));
  CHECK_THAT(
      sign_of([](auto& r) { r.limits.clock_fma_per_second = 2e11; }),
      Catch::Matchers::ContainsSubstring("50 %") && Catch::Matchers::ContainsSubstring("2000 MHz"));
  // What is shorter than a millisecond is not judged.
  f.min_seconds = 1e-4, f.median_seconds = 1e-4, f.max_seconds = 9e-4;
  CHECK(idle.disturbances().empty());
}

TEST_CASE("the table for spreadsheets has a line a kernel, and every figure of the JSON") {
  const std::string csv = to_csv(measured());
  nlohmann::json kernels = to_json(measured())["kernels"];
  for (auto& kernel : kernels) {
    // Lists and sentences are no cells.
    for (const char* name : {"runs", "instruction_mix", "limited_by", "sizes"}) kernel.erase(name);
  }
  CHECK(static_cast<std::size_t>(std::ranges::count(csv, '\n')) == 1 + kernels.size());
  const std::string names = csv.substr(0, csv.find('\n'));
  CHECK(static_cast<std::size_t>(1 + std::ranges::count(names, ',')) == kernels[0].size());
  for (const auto& [name, figure] : kernels[0].items()) {
    CHECK_THAT("," + names + ",", Catch::Matchers::ContainsSubstring("," + name + ","));
  }
  const std::size_t line = names.size() + 1;
  CHECK(csv.substr(line, csv.find('\n', line) - line).starts_with("energy,1,3000,40,"));
  CHECK(static_cast<std::size_t>(std::ranges::count(csv, ',')) ==
        (kernels[0].size() - 1) * (1 + kernels.size()));
  ScalingReport scaling;
  scaling.points = {{1, 100, 8, 0.5, 4096}};
  CHECK(to_csv(scaling) == "iterations,samples,factors,seconds,device_bytes\n1,100,8,0.5,4096\n");
}

TEST_CASE("a profile keeps every run, and the limit beside it") {
  const nlohmann::json json = to_json(measured());
  CHECK(json["layout"] == to_string(measured().layout));
  for (const nlohmann::json& kernel : json["kernels"]) {
    auto seconds = kernel["runs"]["seconds"].get<std::vector<double>>();
    REQUIRE(seconds.size() >= 2);  // more where other programs disturb them
    std::ranges::sort(seconds);
    CHECK(seconds.front() == kernel["min_seconds"]);
    CHECK(seconds.back() == kernel["max_seconds"]);
    const auto limits = kernel["runs"]["fma_per_second"].get<std::vector<double>>();
    REQUIRE(limits.size() == seconds.size());
    for (const double limit : limits) CHECK(limit > 0);
  }
}

TEST_CASE("a kernel slower than its baseline is named") {
  nlohmann::json baseline = to_json(measured());
  CHECK(regressions(measured(), baseline, 0).empty());
  auto& energy = baseline["kernels"][0];
  energy["median_seconds"] = energy["median_seconds"].get<double>() / 2;
  const auto slower = regressions(measured(), baseline, 0.5);
  REQUIRE(slower.size() == 1);
  CHECK_THAT(slower[0], Catch::Matchers::ContainsSubstring("energy, n = 1") &&
                            Catch::Matchers::ContainsSubstring("2.00 times"));
  CHECK(regressions(measured(), baseline, 1.1).empty());
}

TEST_CASE("a baseline that cannot be compared is refused") {
  CHECK_THROWS_AS(regressions(measured(), nlohmann::json::array(), 0.1), InputError);
  nlohmann::json other = to_json(measured());
  for (auto& kernel : other["kernels"]) kernel["samples"] = 5;
  CHECK_THROWS_WITH(regressions(measured(), other, 0.1),
                    Catch::Matchers::ContainsSubstring("same size"));
}

TEST_CASE("profile options name what is wrong") {
  ProfileOptions options = small();
  options.factors = 2;
  CHECK_THROWS_WITH(options.validate(), Catch::Matchers::ContainsSubstring("factors: 2"));
  options = small();
  options.lane_width = 3;
  CHECK_THROWS_WITH(options.validate(), Catch::Matchers::ContainsSubstring("lane_width: 3"));
}

TEST_CASE("a launch of one's own has the figures of the same kernel in a profile") {
  const Device& device = test::shared_device();
  ProfileOptions options;
  options.sample_points = 20'000;
  options.factors = 200;
  options.kernels = {"energy_terms"};
  options.iterations = 2;
  const profiling::Workload work = profiling::make_workload(options);
  const auto evaluator = profiling::make_evaluator(device, work, 1, Precision::single);
  const OwnLaunch launch{.kernel = "energy_terms",
                         .run = [&] { evaluator->evaluate(work.map, false); },
                         .slots = 20'000.0 * 200 * 13,
                         .repeats = 7};
  const KernelFigures own = profile_launch(device, launch);
  CHECK(own.limit == "fma");
  CHECK(own.run_seconds.size() == 7);
  CHECK(own.slots == launch.slots);
  CHECK(own.min_seconds <= own.median_seconds);
  if (own.share_of_limit) CHECK((*own.share_of_limit > 0 && *own.share_of_limit <= 1));
  if (own.instructions) CHECK_FALSE(own.limited_by.empty());
  const OwnLaunch unknown{.kernel = "energy_terms", .run = launch.run};
  CHECK(profile_launch(device, unknown).share_verdict.empty());
}
