#include "profile_compare.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "failure.hpp"
#include "files.hpp"

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
    return rounds.made > 0 ? "undecided; profile again on an idle machine, or with more --seconds"
                           : "undecided; profile again on an idle machine, or with more --repeats";
  }
  return fmt::format(
      "undecided: too little data; a confidence of {} in {} kernels takes {} rounds, and the time "
      "was enough for {}; give --seconds {:.0f} or more, fewer --kernels, or a lower --confidence",
      confidence, comparison.kernels.size(), rounds.least, rounds.made,
      std::ceil(1.2 * rounds.seconds / rounds.made * rounds.least));
}

}  // namespace

int compare_profiles(const std::string& before, const std::string& after,
                     const benchmark::ComparisonOptions& options, Session& session) {
  const nlohmann::json old = read_report(before, "OLD");
  const nlohmann::json now = read_report(after, "NEW");
  return show_comparison(benchmark::compare_profiles(old, now, options), options, {}, session);
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

}  // namespace qjulia::tools
