#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/median.hpp"
#include "base/text.hpp"
#include "profile/explain.hpp"
#include "profile/interval.hpp"
#include "profile/json_values.hpp"
#include "profile/roof.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/profile/profile.hpp"

namespace qjulia {

using namespace profiling;
namespace {

std::optional<double> measured_over_predicted(const KernelFigures& f) {
  if (!f.predicted_seconds) return std::nullopt;
  return f.median_seconds / *f.predicted_seconds;
}

/// Runs of less are too short to judge by their spread.
constexpr double kLongEnough = 1e-3;
/// How far the times of a kernel's runs spread on an idle machine.
constexpr double kUsualSpread = 0.25;
/// Least share of a multiply-add a lane and cycle that an idle machine reaches.
constexpr double kUsualClock = 0.75;

/// Null where counters were not wanted, or the driver or the system does not say.
void add_counters(const KernelFigures& f, nlohmann::json& json) {
  for (const char* name : kEventNames) {
    const auto found = f.events.find(name);
    json[name] = found == f.events.end() ? nlohmann::json(nullptr) : nlohmann::json(found->second);
  }
  const auto& r = f.resources;
  const auto known = [&](std::uint64_t KernelResources::*value) {
    return r ? nlohmann::json((*r).*value) : nlohmann::json(nullptr);
  };
  json["group_size"] = known(&KernelResources::group_size);
  json["group_multiple"] = known(&KernelResources::group_multiple);
  json["local_bytes"] = known(&KernelResources::local_bytes);
  json["private_bytes"] = known(&KernelResources::private_bytes);
  json["registers"] = r ? or_null(r->registers) : nlohmann::json(nullptr);
  json["spilled_bytes"] = r ? or_null(r->spilled_bytes) : nlohmann::json(nullptr);
  json["resident_items"] = r ? or_null(r->resident_items) : nlohmann::json(nullptr);
}

bool same_work(const KernelFigures& f, const nlohmann::json& old) {
  return old.at("kernel") == f.kernel && old.at("iterations") == f.iterations &&
         old.at("samples") == f.samples && old.at("factors") == f.factors &&
         old.at("width") == f.width && old.at("precision") == to_string(f.precision);
}

}  // namespace

nlohmann::json to_json(const KernelFigures& f) {
  const Interval interval = f.run_seconds.empty() ? Interval{} : interval_of_median(f.run_seconds);
  nlohmann::json json{
      {"kernel", f.kernel},
      {"iterations", f.iterations},
      {"samples", f.samples},
      {"factors", f.factors},
      {"width", f.width},
      {"precision", to_string(f.precision)},
      {"is_one_kernel", f.is_one_kernel},
      {"launches", f.is_one_kernel ? nlohmann::json(f.launches) : nlohmann::json(nullptr)},
      {"sizes", or_null(f.sizes)},
      {"runs_left_out", f.runs_left_out},
      {"work_is_at_most", f.work_is_at_most},
      {"median_seconds", f.median_seconds},
      {"min_seconds", f.min_seconds},
      {"max_seconds", f.max_seconds},
      {"spread", f.spread()},
      {"median_low", interval.low},
      {"median_high", interval.high},
      {"wall_seconds", f.wall_seconds},
      {"median_cpu_seconds", f.run_cpu_seconds.empty()
                                 ? nlohmann::json(nullptr)
                                 : nlohmann::json(base::median(f.run_cpu_seconds))},
      {"processors", or_null(f.processors())},
      {"executed_factor_iterations", or_null(f.executed_factor_iterations)},
      {"pairs_per_second", or_null(f.pairs_per_second)},
      {"slots", or_null(f.slots)},
      {"memory_bytes", or_null(f.memory_bytes)},
      {"share_of_limit", or_null(f.share_of_limit)},
      {"share_low", or_null(f.share_low)},
      {"share_high", or_null(f.share_high)},
      {"share_verdict", or_null(f.share_verdict)},
      {"predicted_seconds", or_null(f.predicted_seconds)},
      {"measured_over_predicted", or_null(measured_over_predicted(f))},
      {"limit", or_null(f.limit)},
      {"instruction_mix", or_null(f.instructions)},
      {"limited_by", or_null(f.limited_by)},
      {"runs",
       {{"seconds", f.run_seconds},
        {"fma_per_second", f.run_fma_per_second},
        {"cpu_seconds", or_null(f.run_cpu_seconds)},
        {"fma_per_cpu_second", or_null(f.run_fma_per_cpu_second)}}}};
  add_counters(f, json);
  return json;
}

nlohmann::json to_json(const ProfileReport& report) {
  nlohmann::json kernels = nlohmann::json::array();
  for (const KernelFigures& f : report.kernels) kernels.push_back(to_json(f));
  return {{"device",
           {{"name", report.device.name},
            {"platform", report.device.platform_name},
            {"driver", report.device.driver_version},
            {"compute_units", report.device.compute_units}}},
          {"layout", to_string(report.layout)},
          {"tuned", report.is_tuned},
          {"tuning", to_json(report.tuning)},
          {"limits",
           {{"fma_per_second", report.limits.fma_per_second},
            {"fma_per_second_after", report.fma_per_second_after},
            {"clock_fma_per_second", report.limits.clock_fma_per_second},
            {"bytes_per_second", report.limits.bytes_per_second},
            {"fma_per_cpu_second", positive_or_null(report.limits.fma_per_cpu_second)},
            {"bytes_per_cpu_second", positive_or_null(report.limits.bytes_per_cpu_second)},
            {"caches", to_json(report.caches)},
            {"launch_seconds", report.limits.launch_seconds}}},
          {"waited_share", or_null(report.waited_share)},
          {"processor_use", or_null(report.use)},
          {"disturbances", report.disturbances()},
          {"left_out", report.left_out},
          {"not_counted", report.not_counted},
          {"kernels", kernels}};
}

std::string to_csv(const ProfileReport& report) {
  const std::string names =
      "kernel,iterations,samples,factors,width,precision,is_one_kernel,launches,runs_left_out,"
      "work_is_at_most,"
      "median_seconds,min_seconds,"
      "max_seconds,"
      "spread,median_low,median_high,wall_seconds,median_cpu_seconds,processors,executed_factor_"
      "iterations,pairs_per_"
      "second,slots,memory_bytes,limit,"
      "share_of_limit,share_low,share_high,share_verdict,predicted_seconds,measured_over_predicted,"
      "cycles,instructions,cache_misses,"
      "stalled_frontend,stalled_backend,cpu_seconds,page_faults,group_size,group_multiple,"
      "local_bytes,private_bytes,registers,spilled_bytes,resident_items";
  std::string text = names + '\n';
  for (const KernelFigures& f : report.kernels) {
    const nlohmann::json figures = to_json(f);
    std::vector<std::string> cells;
    for (const std::string& column : base::split(names, ',')) {
      const nlohmann::json& cell = figures.at(column);
      cells.push_back(cell.is_null()     ? ""
                      : cell.is_string() ? cell.get<std::string>()
                                         : cell.dump());
    }
    text += fmt::format("{}\n", fmt::join(cells, ","));
  }
  return text;
}

std::string ProfileReport::what_limits() const { return limit_lines(kernels); }

std::vector<std::string> ProfileReport::disturbances() const {
  std::vector<std::string> signs;
  const auto is_scattered = [](const KernelFigures& f) {
    return f.min_seconds >= kLongEnough && f.spread() > kUsualSpread;
  };
  const auto scattered = std::ranges::count_if(kernels, is_scattered);
  if (scattered > 0) {
    const auto worst = std::ranges::max_element(
        kernels, {}, [&](const KernelFigures& f) { return is_scattered(f) ? f.spread() : 0; });
    const std::string others = scattered > 1 ? fmt::format(", and of {} more kernels over {:.0f} %",
                                                           scattered - 1, 100 * kUsualSpread)
                                             : std::string();
    signs.push_back(fmt::format("runs of {}, n = {}, lie {:.0f} % apart{}", worst->kernel,
                                worst->iterations, 100 * worst->spread(), others));
  }
  for (std::string& sign :
       signs_of_load(limits.fma_per_second, fma_per_second_after, waited_share, use)) {
    signs.push_back(std::move(sign));
  }
  const double clock = limits.clock_fma_per_second;
  if (limits.fma_per_second < kUsualClock * clock) {
    signs.push_back(fmt::format(
        "the limit is {:.0f} % of a multiply-add a lane and cycle at the {} MHz the device reports",
        100 * limits.fma_per_second / clock, device.clock_mhz));
  }
  return signs;
}

std::vector<std::string> regressions(const ProfileReport& report, const nlohmann::json& baseline,
                                     double tolerance) {
  std::vector<std::string> slower;
  std::size_t compared = 0;
  try {
    for (const KernelFigures& f : report.kernels) {
      for (const nlohmann::json& old : baseline.at("kernels")) {
        if (!same_work(f, old)) continue;
        ++compared;
        const double before = old.at("median_seconds").get<double>();
        if (f.median_seconds <= (1 + tolerance) * before) continue;
        slower.push_back(fmt::format("{}, n = {}: {:.4g} s, {:.2f} times the baseline's {:.4g} s",
                                     f.kernel, f.iterations, f.median_seconds,
                                     f.median_seconds / before, before));
      }
    }
  } catch (const nlohmann::json::exception&) {
    throw InputError("the baseline is not the JSON of a profile; make it again");
  }
  if (compared == 0) {
    throw InputError(
        "nothing in the baseline has the same size, width and precision; use the same options");
  }
  return slower;
}

}  // namespace qjulia
