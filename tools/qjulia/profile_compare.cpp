#include "profile_compare.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "base/input_file.hpp"
#include "base/text.hpp"
#include "failure.hpp"
#include "qjulia/error.hpp"

namespace qjulia::tools {
namespace {

std::string table(const benchmark::ProfileComparison& comparison, double confidence) {
  std::string text = fmt::format("{:24} {:>2} {:>10} {:>10} {:>8}   {:17} {}", "kernel", "n",
                                 "OLD s", "NEW s", "NEW/OLD", "bounds", "verdict");
  for (const benchmark::KernelComparison& k : comparison.kernels) {
    text += fmt::format("\n{:24} {:2} {:10.4g} {:10.4g} {:8.3f}   {:.3f} to {:.3f}    {}", k.kernel,
                        k.iterations, k.before_seconds, k.after_seconds, k.ratio.estimate,
                        k.ratio.low, k.ratio.high, to_string(k.verdict));
  }
  return text + fmt::format("\n{} (confidence of all kernels together: {})",
                            to_string(comparison.verdict), confidence);
}

}  // namespace

nlohmann::json read_profile_json(const std::string& path, const std::string& what) {
  constexpr std::uint64_t kLargestFile = std::uint64_t{16} << 20;
  const std::string text = base::read_text_file(path, "profile", kLargestFile);
  auto json = base::is_json_too_deep(text) ? nlohmann::json(nlohmann::json::value_t::discarded)
                                           : nlohmann::json::parse(text, nullptr, false);
  if (json.is_discarded()) {
    throw InputError(fmt::format("{} '{}' is not JSON; make it with --json", what, path));
  }
  return json;
}

int compare_profiles(const std::string& before, const std::string& after,
                     const benchmark::ComparisonOptions& options, Session& session) {
  const nlohmann::json old = read_profile_json(before, "OLD");
  const nlohmann::json now = read_profile_json(after, "NEW");
  return show_comparison(benchmark::compare_profiles(old, now, options), options, 0, session);
}

int show_comparison(const benchmark::ProfileComparison& comparison,
                    const benchmark::ComparisonOptions& options, int rounds, Session& session) {
  nlohmann::json json = to_json(comparison);
  json["confidence"] = options.confidence;
  json["tolerance"] = options.tolerance;
  if (rounds > 0) json["rounds"] = rounds;
  session.console.result(table(comparison, options.confidence), json);
  for (const std::string& line : comparison.differences) session.console.note("differs: " + line);
  for (const std::string& line : comparison.left_out) session.console.note("not compared: " + line);
  for (const std::string& line : comparison.busy) {
    session.console.warn("the machine was busy: " + line);
  }
  switch (comparison.verdict) {
    case benchmark::Verdict::slower:
      return kFailed;
    case benchmark::Verdict::undecided:
      session.console.warn("undecided; profile again on an idle machine, or with more --repeats");
      return kUndecided;
    case benchmark::Verdict::same:
    case benchmark::Verdict::faster:
      break;
  }
  return kDone;
}

}  // namespace qjulia::tools
