#include "benchmark/profile_comparison.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "qjulia/base/error.hpp"

namespace qjulia::benchmark {
namespace {

using nlohmann::json;

/// How far a limit's runs spread on an idle machine, and between two profiles, over the median;
/// the highest and lowest tenth left out.
constexpr double kUsualDrift = 0.1;
/// A kernel whose bounds allow more than this to be the slowdown is not called the same, unless the
/// tolerance is larger.
constexpr double kTooWide = 0.25;

/// Runs by one clock, and the limit in a second of it beside each.
struct TimedRuns {
  std::vector<double> seconds, limits;
};

struct KernelRuns {
  std::string name;
  int iterations = 1;
  std::size_t samples = 0, factors = 0;
  std::string arithmetic;  ///< width and precision
  TimedRuns by_device;
  std::optional<TimedRuns> by_cpu;  ///< where they are known

  const TimedRuns& by(Clock clock) const { return clock == Clock::cpu ? *by_cpu : by_device; }
};

/// The first of `Across` that allows profiles to differ in it.
struct Circumstance {
  std::string name, value;
  Across may_differ = Across::devices;
};

struct Profile {
  std::string which;  ///< "OLD" or "NEW"
  std::vector<Circumstance> circumstances;
  std::vector<KernelRuns> kernels;
};

bool are_positive(const std::vector<double>& numbers) {
  return !numbers.empty() &&
         std::ranges::all_of(numbers, [](double x) { return std::isfinite(x) && x > 0; });
}

std::vector<double> positive_numbers(const json& list, const std::string& which) {
  auto numbers = list.get<std::vector<double>>();
  if (!are_positive(numbers)) {
    throw InputError(fmt::format("{} has runs that took no time, or none; profile again", which));
  }
  return numbers;
}

KernelRuns kernel_runs(const json& kernel, const std::string& which) {
  KernelRuns runs;
  runs.name = kernel.at("kernel");
  runs.iterations = kernel.at("iterations");
  runs.samples = kernel.at("samples");
  runs.factors = kernel.at("factors");
  runs.arithmetic = fmt::format("{} lanes, {}", kernel.at("width").get<int>(),
                                kernel.at("precision").get<std::string>());
  const json& all = kernel.at("runs");
  runs.by_device = {positive_numbers(all.at("seconds"), which),
                    positive_numbers(all.at("fma_per_second"), which)};
  if (runs.by_device.seconds.size() != runs.by_device.limits.size()) {
    throw InputError(fmt::format("{} has runs without a limit beside them; profile again", which));
  }
  const json seconds = all.value("cpu_seconds", json()),
             limits = all.value("fma_per_cpu_second", json());
  if (seconds.is_null() || limits.is_null()) return runs;
  const TimedRuns by_cpu{seconds.get<std::vector<double>>(), limits.get<std::vector<double>>()};
  if (are_positive(by_cpu.seconds) && are_positive(by_cpu.limits) &&
      by_cpu.seconds.size() == by_cpu.limits.size()) {
    runs.by_cpu = by_cpu;
  }
  return runs;
}

Profile read_profile(const json& all, const std::string& which) {
  expect_measured(all, which);
  Profile profile{which, {}, {}};
  try {
    const json& device = all.at("device");
    for (const char* name : {"name", "platform", "driver"}) {
      profile.circumstances.push_back({name == std::string("name") ? "device" : name,
                                       device.at(name).get<std::string>(), Across::drivers});
    }
    // Profiles of earlier versions do not have it.
    profile.circumstances.push_back(
        {"compute units", device.value("compute_units", json()).dump()});
    profile.circumstances.push_back({"layout", all.at("layout").get<std::string>()});
    profile.circumstances.push_back({"tuning", all.at("tuning").dump()});
    for (const json& kernel : all.at("kernels")) {
      profile.kernels.push_back(kernel_runs(kernel, which));
    }
  } catch (const json::exception&) {
    throw InputError(
        fmt::format("{} is not a profile that keeps its runs; make it again, with 'qjulia profile "
                    "measure --json'",
                    which));
  }
  if (profile.kernels.empty()) throw InputError(which + " has no kernels; profile again");
  profile.circumstances.push_back({"arithmetic", profile.kernels.front().arithmetic});
  return profile;
}

/// Notes what differs. @return the least that allows it
Across compare_circumstances(const Profile& before, const Profile& after,
                             std::vector<std::string>& differences) {
  Across between = Across::builds;
  for (std::size_t i = 0; i < before.circumstances.size(); ++i) {
    const auto& [name, old, may_differ] = before.circumstances[i];
    const std::string& now = after.circumstances[i].value;
    if (old == now) continue;
    differences.push_back(fmt::format("{}: {} in OLD, {} in NEW", name, old, now));
    between = std::max(between, may_differ);
  }
  return between;
}

/// Of profiles under two drivers only the user knows that they are of one machine.
bool is_of_one_device(const Profile& before, const Profile& after, Across across) {
  if (across == Across::drivers) return true;
  for (std::size_t i = 0; i < before.circumstances.size(); ++i) {
    const Circumstance& old = before.circumstances[i];
    if (old.may_differ == Across::drivers && old.value != after.circumstances[i].value)
      return false;
  }
  return true;
}

double at_share(std::vector<double> values, double share) {
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(
      std::lround(share * static_cast<double>(values.size() - 1)))];
}

bool has_cpu_seconds(const Profile& profile) {
  return std::ranges::all_of(profile.kernels,
                             [](const KernelRuns& kernel) { return kernel.by_cpu.has_value(); });
}

std::vector<double> limits_of(const Profile& profile, Clock clock) {
  std::vector<double> all;
  for (const KernelRuns& kernel : profile.kernels) {
    const std::vector<double>& limits = kernel.by(clock).limits;
    all.insert(all.end(), limits.begin(), limits.end());
  }
  return all;
}

std::vector<std::string> busy_signs(const Profile& before, const Profile& after, bool is_one_device,
                                    Clock clock) {
  const char* const unit = clock == Clock::cpu ? "G a CPU second" : "G/s";
  std::vector<std::string> signs;
  for (const Profile* profile : {&before, &after}) {
    const auto limits = limits_of(*profile, clock);
    const double low = at_share(limits, 0.1), high = at_share(limits, 0.9);
    if (high - low > kUsualDrift * at_share(limits, 0.5)) {
      signs.push_back(
          fmt::format("the multiply-add limit went from {:.4g} to {:.4g} {} while {} was measured",
                      1e-9 * low, 1e-9 * high, unit, profile->which));
    }
  }
  const double old = at_share(limits_of(before, clock), 0.5);
  const double now = at_share(limits_of(after, clock), 0.5);
  if (is_one_device && std::abs(old - now) > kUsualDrift * std::min(old, now)) {
    signs.push_back(fmt::format("the multiply-add limit was {:.4g} {} in OLD and {:.4g} in NEW",
                                1e-9 * old, unit, 1e-9 * now));
  }
  return signs;
}

/// Seconds times the limit: what the device could have done meanwhile. Of two devices the times are
/// compared as they are.
std::vector<double> costs(const TimedRuns& runs, bool is_one_device) {
  std::vector<double> all = runs.seconds;
  for (std::size_t i = 0; is_one_device && i < all.size(); ++i) all[i] *= runs.limits[i];
  return all;
}

Verdict verdict_of(const RatioBounds& ratio, bool is_busy, double tolerance) {
  if (ratio.low > 1 + tolerance) return is_busy ? Verdict::undecided : Verdict::slower;
  if (is_busy) return ratio.high <= 1 + tolerance ? Verdict::same : Verdict::undecided;
  if (ratio.high < 1) return Verdict::faster;
  return ratio.high > 1 + std::max(kTooWide, tolerance) ? Verdict::undecided : Verdict::same;
}

const KernelRuns* find(const std::vector<KernelRuns>& kernels, const KernelRuns& wanted) {
  const auto found = std::ranges::find_if(kernels, [&](const KernelRuns& kernel) {
    return kernel.name == wanted.name && kernel.iterations == wanted.iterations;
  });
  return found == kernels.end() ? nullptr : &*found;
}

using Pairs = std::vector<std::pair<const KernelRuns*, const KernelRuns*>>;

Pairs common_kernels(const Profile& before, const Profile& after,
                     std::vector<std::string>& left_out) {
  Pairs pairs;
  for (const KernelRuns& old : before.kernels) {
    const KernelRuns* const now = find(after.kernels, old);
    if (now == nullptr) {
      left_out.push_back(fmt::format("{}, n = {}: only in OLD", old.name, old.iterations));
    } else if (old.samples != now->samples || old.factors != now->factors) {
      throw InputError(fmt::format(
          "{}, n = {}, was measured with {} samples and {} factors in OLD, "
          "{} and {} in NEW; use the same --samples and --factors",
          old.name, old.iterations, old.samples, old.factors, now->samples, now->factors));
    } else {
      pairs.emplace_back(&old, now);
    }
  }
  for (const KernelRuns& now : after.kernels) {
    if (find(before.kernels, now) == nullptr) {
      left_out.push_back(fmt::format("{}, n = {}: only in NEW", now.name, now.iterations));
    }
  }
  if (pairs.empty()) throw InputError("OLD and NEW have no kernel in common; profile both again");
  return pairs;
}

}  // namespace

void ComparisonOptions::validate() const {
  if (!(confidence > 0.5 && confidence < 1)) {
    throw InputError(fmt::format(
        "--confidence {} is out of range; give a number between 0.5 and 1, such as 0.95",
        confidence));
  }
  if (!(tolerance >= 0 && tolerance <= 10)) {
    throw InputError(
        fmt::format("--tolerance {} is out of range; give 0 to 10, such as 0.02", tolerance));
  }
}

std::string to_string(Across across) {
  switch (across) {
    case Across::builds:
      return "builds";
    case Across::drivers:
      return "drivers";
    case Across::devices:
      break;
  }
  return "devices";
}

std::string to_string(Clock clock) { return clock == Clock::cpu ? "cpu" : "device"; }

std::string to_string(Verdict verdict) {
  switch (verdict) {
    case Verdict::same:
      return "same";
    case Verdict::faster:
      return "faster";
    case Verdict::slower:
      return "slower";
    case Verdict::undecided:
      break;
  }
  return "undecided";
}

void expect_measured(const json& report, const std::string& name) {
  if (!report.is_object() || !report.contains("stages")) return;
  throw InputError(fmt::format(
      "{} is what one command wrote for --profile; this reads reports that repeat each kernel: "
      "those of 'qjulia profile measure MAP --jobs fit --json', of the fit's map",
      name));
}

ProfileComparison compare_profiles(const json& before, const json& after,
                                   const ComparisonOptions& options) {
  options.validate();
  const Profile old = read_profile(before, "OLD");
  const Profile now = read_profile(after, "NEW");
  ProfileComparison comparison;
  comparison.between = compare_circumstances(old, now, comparison.differences);
  if (comparison.between > options.across) {
    throw InputError(
        fmt::format("the profiles cannot be compared: {}; measure both in the same way, or give {}",
                    fmt::join(comparison.differences, "; "),
                    comparison.between == Across::drivers
                        ? "--across-drivers if both are of one machine, else --across-devices"
                        : "--across-devices"));
  }
  const bool is_one_device = is_of_one_device(old, now, options.across);
  const Pairs pairs = common_kernels(old, now, comparison.left_out);
  comparison.busy = busy_signs(old, now, is_one_device, Clock::device);
  bool is_busy = !comparison.busy.empty();
  if (is_busy && is_one_device && has_cpu_seconds(old) && has_cpu_seconds(now)) {
    comparison.clock = Clock::cpu;
    const auto signs = busy_signs(old, now, is_one_device, Clock::cpu);
    comparison.busy.insert(comparison.busy.end(), signs.begin(), signs.end());
    is_busy = !signs.empty();
  }
  // So that all kernels together have the confidence (Bonferroni).
  const double error = (1 - options.confidence) / static_cast<double>(pairs.size());
  for (const auto& [x, y] : pairs) {
    const TimedRuns &first = x->by(comparison.clock), &second = y->by(comparison.clock);
    const auto ratio =
        ratio_bounds(costs(first, is_one_device), costs(second, is_one_device), error);
    if (!ratio) {
      throw InputError(fmt::format(
          "{} and {} runs per kernel are too few for a confidence of {} in {} kernels; "
          "profile with more --repeats, or give a lower --confidence",
          first.seconds.size(), second.seconds.size(), options.confidence, pairs.size()));
    }
    comparison.kernels.push_back({x->name, x->iterations, at_share(first.seconds, 0.5),
                                  at_share(second.seconds, 0.5), *ratio,
                                  verdict_of(*ratio, is_busy, options.tolerance)});
  }
  for (const Verdict worst : {Verdict::slower, Verdict::undecided, Verdict::faster}) {
    if (std::ranges::find(comparison.kernels, worst, &KernelComparison::verdict) ==
        comparison.kernels.end()) {
      continue;
    }
    comparison.verdict = worst;
    break;
  }
  return comparison;
}

json to_json(const ProfileComparison& comparison) {
  json kernels = json::array();
  for (const KernelComparison& k : comparison.kernels) {
    const auto bound = [&](double RatioBounds::*value) {
      return k.ratio ? json((*k.ratio).*value) : json(nullptr);
    };
    kernels.push_back({{"kernel", k.kernel},
                       {"iterations", k.iterations},
                       {"before_seconds", k.before_seconds},
                       {"after_seconds", k.after_seconds},
                       {"ratio", bound(&RatioBounds::estimate)},
                       {"ratio_low", bound(&RatioBounds::low)},
                       {"ratio_high", bound(&RatioBounds::high)},
                       {"verdict", to_string(k.verdict)}});
  }
  return {{"verdict", to_string(comparison.verdict)}, {"between", to_string(comparison.between)},
          {"clock", to_string(comparison.clock)},     {"kernels", kernels},
          {"differences", comparison.differences},    {"busy", comparison.busy},
          {"left_out", comparison.left_out}};
}

}  // namespace qjulia::benchmark
