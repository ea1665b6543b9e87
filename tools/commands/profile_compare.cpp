/// qjulia profile compare: two profiles, kernel by kernel.

#include "commands/profile_compare.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "commands/profile_commands.hpp"
#include "console/failure.hpp"
#include "describe/files.hpp"

namespace qjulia::tools {
namespace {

std::string table(const benchmark::ProfileComparison& comparison, double confidence) {
  const bool is_cpu = comparison.clock == benchmark::Clock::cpu;
  std::string text = fmt::format("{:24} {:>2} {:>10} {:>10} {:>8}   {:17} {}", "kernel", "n",
                                 is_cpu ? "OLD CPU s" : "OLD s", is_cpu ? "NEW CPU s" : "NEW s",
                                 "NEW/OLD", "bounds", "verdict");
  for (const benchmark::KernelComparison& k : comparison.kernels) {
    const std::string ratio = k.ratio ? fmt::format("{:.3f}", k.ratio->estimate) : "-";
    const std::string bounds =
        k.ratio ? fmt::format("{:.3f} to {:.3f}", k.ratio->low, k.ratio->high) : "too little data";
    text += fmt::format("\n{:24} {:2} {:10.4g} {:10.4g} {:>8}   {:17} {}", k.kernel, k.iterations,
                        k.before_seconds, k.after_seconds, ratio, bounds, to_string(k.verdict));
  }
  return text + fmt::format("\n{} (confidence of all kernels together: {})",
                            to_string(comparison.verdict), confidence);
}

/// What helps where nothing could be decided.
std::string advice(const benchmark::ProfileComparison& comparison, const Rounds& rounds,
                   double confidence) {
  const bool has_too_little = std::ranges::any_of(
      comparison.kernels, [](const benchmark::KernelComparison& k) { return !k.ratio; });
  if (!has_too_little) {
    return rounds.made > 0
               ? "undecided; profile again on an idle machine, or with more --time-limit"
               : "undecided; profile again on an idle machine, or with more --repeats";
  }
  return fmt::format(
      "undecided: too little data; a confidence of {} in {} kernels takes {} rounds, and the time "
      "was enough for {}; give --time-limit {:.0f} or more, fewer --kernels, or a lower "
      "--confidence",
      confidence, comparison.kernels.size(), rounds.least, rounds.made,
      std::ceil(1.2 * rounds.seconds / rounds.made * rounds.least));
}

struct CompareProfilesArguments : ComparisonArguments {
  std::string before, after;
};

int run_compare_profiles(const CompareProfilesArguments& arguments, Session& session) {
  session.check_outputs({{arguments.before, arguments.after}, {}});
  const benchmark::ComparisonOptions options = arguments.checked();
  const nlohmann::json old = read_report(arguments.before, "OLD");
  const nlohmann::json now = read_report(arguments.after, "NEW");
  return show_comparison(benchmark::compare_profiles(old, now, options), options, {}, session);
}

void describe_compare_profiles(Command command, CompareProfilesArguments& a) {
  command.input("OLD", a.before, "A --json report of 'qjulia profile measure'")
      .offers_files({".json"});
  command.input("NEW", a.after, "A later one").offers_files({".json"});
  add_comparison(command, a);
}

}  // namespace

const char* const kComparisonHelp =
    "The time of each run is multiplied by the multiply-add limit measured right after it; on a\n"
    "busy machine, CPU seconds and the limit in a CPU second are used instead.\n"
    "A kernel is slower if the lower bound of its slowdown is over 2 %. Exit code 0: no kernel is\n"
    "slower; 1: some are; 4: undecided, because the machine was busy or runs differ too much.";

benchmark::ComparisonOptions ComparisonArguments::checked() const {
  benchmark::ComparisonOptions made = options;
  if (across_drivers) made.across = benchmark::Across::drivers;
  if (across_devices) made.across = benchmark::Across::devices;
  made.validate();
  return made;
}

void add_comparison(Command command, ComparisonArguments& arguments) {
  command.add("--confidence", &arguments.options.confidence, "NUMBER",
              "The confidence for all kernels together. With 0.95, at most one comparison in "
              "twenty wrongly calls a kernel slower");
  const Option drivers =
      command.flag("--across-drivers", arguments.across_drivers,
                   "Compare two drivers, or two versions of one, on one machine. Driver, platform "
                   "and the device's name may differ");
  command
      .flag("--across-devices", arguments.across_devices,
            "Compare although device, driver, layout, width, precision or tuning differ, and say "
            "so")
      .excludes({drivers});
}

int show_comparison(const benchmark::ProfileComparison& comparison,
                    const benchmark::ComparisonOptions& options, const Rounds& rounds,
                    Session& session) {
  nlohmann::json json = to_json(comparison);
  json["confidence"] = options.confidence;
  json["tolerance"] = options.tolerance;
  if (rounds.made > 0) {
    json["rounds"] = rounds.made;
    json["least_rounds"] = rounds.least;
  }
  session.console.result(table(comparison, options.confidence), json);
  for (const std::string& line : comparison.differences) session.console.note("differs: " + line);
  if (options.across == benchmark::Across::drivers) {
    session.console.note(
        "compared as drivers of one machine: a kernel's time is multiplied by the multiply-add "
        "limit that its own driver reached beside it");
  }
  for (const std::string& line : comparison.left_out) session.console.note("not compared: " + line);
  for (const std::string& line : comparison.busy) {
    session.console.warn("the machine was busy: " + line);
  }
  if (comparison.clock == benchmark::Clock::cpu) {
    session.console.note(
        "the machine was busy, so CPU seconds are compared instead of seconds; they do not show "
        "how well the work is spread over processors");
  }
  switch (comparison.verdict) {
    case benchmark::Verdict::slower:
      return kFailed;
    case benchmark::Verdict::undecided:
      session.console.warn(advice(comparison, rounds, options.confidence));
      return kUndecided;
    case benchmark::Verdict::same:
    case benchmark::Verdict::faster:
      break;
  }
  return kDone;
}

void add_profile_compare(CommandLine& program, ChosenCommand& chosen) {
  add_command(program, chosen,
              {"profile compare", "Say which kernels became slower, without measuring",
               std::string(R"(Examples:
  qjulia profile measure --json > before.json
  qjulia profile compare before.json after.json
Takes two --json reports and compares all runs of each kernel, with bounds. )") +
                   kComparisonHelp,
               /*can_trace=*/false},
              describe_compare_profiles, run_compare_profiles);
}

}  // namespace qjulia::tools
