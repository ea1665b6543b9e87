#include "commands/profile_tables.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace qjulia::tools {
namespace {

std::string optional_number(const std::optional<double>& value, double scale) {
  return value ? fmt::format("{:.4g}", *value * scale) : "-";
}

/// The measured limit in multiply-adds a lane and cycle; empty where lanes are not known.
std::string in_cycles(const ProfileReport& report) {
  const double clock = report.limits.clock_fma_per_second;
  if (clock == 0) return {};
  return fmt::format(" ({:.2f} a lane and cycle at the {} MHz that the device reports)",
                     report.limits.fma_per_second / clock, report.device.clock_mhz);
}

/// The limit in a CPU second; empty where the device is no CPU.
std::string in_cpu_seconds(const ProfileReport& report) {
  if (report.limits.fma_per_cpu_second == 0) return {};
  return fmt::format("limits in a CPU second, of which shares of multiply-adds are: {:.4g} G\n",
                     1e-9 * report.limits.fma_per_cpu_second);
}

/// "5", or "5 of 8" where others were left out.
std::string runs_text(const KernelFigures& f) {
  const std::size_t runs = f.run_seconds.size();
  return f.runs_left_out == 0 ? std::to_string(runs)
                              : fmt::format("{} of {}", runs, runs + f.runs_left_out);
}

/// The share of the limit, which limit it is, and the interval, with "<" where orbits may have
/// ended early; or the verdict where there is no share.
std::string share_text(const KernelFigures& f) {
  if (!f.share_of_limit) return verdict_text(f.share_verdict, f.share_low, f.share_high);
  return fmt::format("{}{:.1f} %{} ({:.1f} to {:.1f})", f.work_is_at_most ? "<" : "",
                     100 * *f.share_of_limit, f.limit == "memory" ? " m" : "", 100 * *f.share_low,
                     100 * *f.share_high);
}

}  // namespace

std::string profile_table(const ProfileReport& report) {
  const bool has_predictions = std::ranges::any_of(
      report.kernels, [](const KernelFigures& f) { return f.predicted_seconds.has_value(); });
  std::string text = fmt::format(
      "settings: {}\n"
      "limits in a second: {:.4g} G multiply-adds{}, copy {:.4g} GB/s{}; launch {:.3g} us\n"
      "{}"
      "{:24} n    samples  factors     runs   median s      min s   spread  CPUs   Gpairs/s "
      "{:>23}{}",
      report.is_tuned ? "tuned for this device" : "the defaults",
      1e-9 * report.limits.fma_per_second, in_cycles(report), 1e-9 * report.limits.bytes_per_second,
      cache_rates(report.caches), 1e6 * report.limits.launch_seconds, in_cpu_seconds(report),
      "kernel", "of limit", has_predictions ? "  predicted s  measured" : "");
  for (const KernelFigures& f : report.kernels) {
    const auto processors = f.processors();
    text +=
        fmt::format("\n{:24} {:2} {:10} {:8} {:>8} {:10.4g} {:10.4g} {:6.1f} % {:>5} {:>10} {:>23}",
                    f.is_one_kernel ? "  " + f.kernel : f.kernel, f.iterations, f.samples,
                    f.factors, runs_text(f), f.median_seconds, f.min_seconds, 100 * f.spread(),
                    processors ? fmt::format("{:.2f}", *processors) : std::string("-"),
                    optional_number(f.pairs_per_second, 1e-9), share_text(f));
    if (!has_predictions) continue;
    text += fmt::format(" {:>12} {:>9}", optional_number(f.predicted_seconds, 1),
                        f.predicted_seconds
                            ? fmt::format("{:.2f} x", f.median_seconds / *f.predicted_seconds)
                            : std::string("-"));
  }
  const std::string limits = report.what_limits();
  return limits.empty() ? text : text + "\n" + limits;
}

std::string counter_table(const ProfileReport& report) {
  std::string text = fmt::format(
      "{:24} n {:>10} {:>10} {:>9} {:>10} {:>9} {:>9} {:>8} {:>7} {:>6} {:>8} {:>8} {:>5} {:>6} "
      "{:>8}",
      "kernel", "cycles", "instr.", "per cycle", "misses", "stalled f", "stalled b", "CPU s",
      "faults", "group", "multiple", "local B", "regs", "private", "resident");
  for (const KernelFigures& f : report.kernels) {
    const auto event = [&](const char* name) {
      const auto found = f.events.find(name);
      return found == f.events.end() ? std::string("-") : fmt::format("{:.4g}", found->second);
    };
    const auto need = [&](const auto& value) {
      return f.resources ? value(*f.resources) : std::string("-");
    };
    const auto known = [](const std::optional<std::uint64_t>& value) {
      return value ? std::to_string(*value) : std::string("-");
    };
    const auto cycles = f.events.find("cycles"), done = f.events.find("instructions");
    const bool has_both = cycles != f.events.end() && done != f.events.end() && cycles->second > 0;
    text += fmt::format(
        "\n{:24} {} {:>10} {:>10} {:>9} {:>10} {:>9} {:>9} {:>8} {:>7} {:>6} {:>8} {:>8} {:>5} "
        "{:>6} {:>8}",
        f.is_one_kernel ? "  " + f.kernel : f.kernel, f.iterations, event("cycles"),
        event("instructions"),
        has_both ? fmt::format("{:.2f}", done->second / cycles->second) : std::string("-"),
        event("cache_misses"), event("stalled_frontend"), event("stalled_backend"),
        event("cpu_seconds"), event("page_faults"),
        need([](const KernelResources& r) { return std::to_string(r.group_size); }),
        need([](const KernelResources& r) { return std::to_string(r.group_multiple); }),
        need([](const KernelResources& r) { return std::to_string(r.local_bytes); }),
        need([&](const KernelResources& r) { return known(r.registers); }),
        need([](const KernelResources& r) { return std::to_string(r.private_bytes); }),
        need([&](const KernelResources& r) { return known(r.resident_items); }));
  }
  return text;
}

std::string profile_table(const ScalingReport& report) {
  std::string text =
      "energy with gradient\n n    samples  factors       seconds     Gpairs/s   device MB";
  for (const ScalingPoint& p : report.points) {
    const double pairs = static_cast<double>(p.samples * p.factors) * p.iterations;
    text += fmt::format("\n{:2} {:10} {:8} {:13.5f} {:12.2f} {:11.1f}", p.iterations, p.samples,
                        p.factors, p.seconds, 1e-9 * pairs / p.seconds,
                        1e-6 * static_cast<double>(p.device_bytes));
  }
  for (const ScalingLaw& law : report.laws) {
    text += fmt::format(
        "\nn = {}: seconds grow as samples^{:.3f} factors^{:.3f}; worst deviation: × {:.2f}",
        law.iterations, law.samples_exponent, law.factors_exponent, law.worst_ratio);
  }
  return text;
}

std::string profile_table(const TuneReport& report, const std::string& file) {
  const auto ratio_text = [](const std::optional<TimeRatio>& ratio) {
    if (!ratio) return std::string("-");
    return fmt::format("{:.3f} ({:.3f} to {:.3f})", ratio->middle, ratio->low, ratio->high);
  };
  std::string text = fmt::format("{:15} {:>6} {:>11} {:>22} {:>10}", "setting", "value",
                                 "difference", "time (best 1)", "seconds");
  for (const TuneTrial& t : report.trials) {
    double seconds = 0;
    for (const TuneTime& time : t.times) seconds += time.seconds;
    text += fmt::format("\n{:15} {:6} {:11.1e} {:>22} {:10.4g} {}", t.setting, t.value,
                        t.difference, ratio_text(t.time_ratio), seconds,
                        t.taken ? std::string("taken") : t.refused.substr(0, t.refused.find('\n')));
  }
  if (report.why_kept.empty()) {
    text += fmt::format("\ntuned: {} times the time with the settings before\nkept in: {}",
                        ratio_text(report.time_ratio), file);
  } else {
    text += "\nthe settings stay as they were: ";
    text += report.why_kept;
  }
  return text + "\nsettings: " + to_json(report.tuning).dump();
}

std::string profile_table(const GridReport& report) {
  std::string text = fmt::format("{:15} {:>11} {:>11} {:>9}  {}", "job", "median s", "min s",
                                 "spread", "settings");
  for (const GridTime& t : report.times) {
    if (t.seconds.empty()) {
      text += fmt::format("\nrefused: {}", t.refused);
      continue;
    }
    std::vector<double> runs = t.seconds;
    std::ranges::sort(runs);
    const double median = runs[runs.size() / 2];
    text += fmt::format("\n{:15} {:11.4g} {:11.4g} {:7.1f} %  {}", t.job, median, runs.front(),
                        100 * (runs.back() - runs.front()) / median, to_json(t.tuning).dump());
  }
  return text;
}

}  // namespace qjulia::tools
