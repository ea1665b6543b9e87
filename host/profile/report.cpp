#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "qjulia/error.hpp"
#include "qjulia/profile.hpp"

namespace qjulia {
namespace {

nlohmann::json or_null(const std::optional<double>& value) {
  return value ? nlohmann::json(*value) : nlohmann::json(nullptr);
}

std::optional<double> measured_over_predicted(const KernelFigures& f) {
  if (!f.predicted_seconds) return std::nullopt;
  return f.median_seconds / *f.predicted_seconds;
}

nlohmann::json to_json(const KernelFigures& f) {
  return {{"kernel", f.kernel},
          {"iterations", f.iterations},
          {"samples", f.samples},
          {"factors", f.factors},
          {"width", f.width},
          {"precision", to_string(f.precision)},
          {"median_seconds", f.median_seconds},
          {"min_seconds", f.min_seconds},
          {"wall_seconds", f.wall_seconds},
          {"executed_factor_iterations", or_null(f.executed_factor_iterations)},
          {"pairs_per_second", or_null(f.pairs_per_second)},
          {"slots", or_null(f.slots)},
          {"memory_bytes", or_null(f.memory_bytes)},
          {"share_of_limit", or_null(f.share_of_limit)},
          {"predicted_seconds", or_null(f.predicted_seconds)},
          {"measured_over_predicted", or_null(measured_over_predicted(f))},
          {"limit", f.limit.empty() ? nlohmann::json(nullptr) : nlohmann::json(f.limit)}};
}

bool same_work(const KernelFigures& f, const nlohmann::json& old) {
  return old.at("kernel") == f.kernel && old.at("iterations") == f.iterations &&
         old.at("samples") == f.samples && old.at("factors") == f.factors &&
         old.at("width") == f.width && old.at("precision") == to_string(f.precision);
}

}  // namespace

nlohmann::json to_json(const ProfileReport& report) {
  nlohmann::json kernels = nlohmann::json::array();
  for (const KernelFigures& f : report.kernels) kernels.push_back(to_json(f));
  return {{"device",
           {{"name", report.device.name},
            {"platform", report.device.platform_name},
            {"driver", report.device.driver_version},
            {"compute_units", report.device.compute_units}}},
          {"tuned", report.is_tuned},
          {"tuning", to_json(report.tuning)},
          {"limits",
           {{"fma_per_second", report.limits.fma_per_second},
            {"bytes_per_second", report.limits.bytes_per_second},
            {"launch_seconds", report.limits.launch_seconds}}},
          {"kernels", kernels}};
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
