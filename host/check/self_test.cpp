#include "qjulia/check/self_test.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/fnv_hash.hpp"
#include "base/input_file.hpp"
#include "base/output_file.hpp"
#include "check/checks.hpp"
#include "device/cache_folder.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia {
namespace {

using check::Check;
using check::kInfinite;

struct PlannedCheck {
  const Check* check;
  Precision precision;
  double tolerance;
};

/// Every program there is, those first that others build on, at the device's precisions.
std::vector<PlannedCheck> planned(const DeviceInfo& info) {
  std::vector<PlannedCheck> plan;
  for (const Precision precision : kPrecisions) {
    const bool is_double = precision == Precision::dbl;
    if (is_double && !info.has_double) continue;
    for (const auto& checks :
         {check::device_checks(), check::field_checks(), check::energy_checks(),
          check::shape_checks(), check::surface_checks(), check::picture_checks()}) {
      for (const Check& check : checks) {
        const double tolerance = is_double ? check.in_double : check.in_single;
        plan.push_back({&check, precision, tolerance});
      }
    }
  }
  return plan;
}

ProgramCheck without_result(const PlannedCheck& plan) {
  return {plan.check->program, plan.precision, plan.check->compared, kInfinite, plan.tolerance, {}};
}

ProgramCheck run(const PlannedCheck& plan, const Device& device) {
  ProgramCheck result = without_result(plan);
  try {
    result.difference = plan.check->difference(device, plan.precision);
  } catch (const KernelBuildError& error) {
    result.is_built = false;
    result.problem = error.what();
  } catch (const Error& error) {
    result.problem = error.what();
  }
  return result;
}

SelfTestReport run_all(const std::vector<PlannedCheck>& plan, const Device& device,
                       const ProgressMonitor& monitor) {
  SelfTestReport report{device.info(), device.layout(), {}};
  for (const PlannedCheck& one : plan) {
    throw_if_stopped(monitor.stop);
    const auto done = static_cast<double>(report.checks.size());
    monitor.report({"checking", done / static_cast<double>(plan.size()), -1, one.check->program});
    report.checks.push_back(run(one, device));
  }
  monitor.report({"checking", 1, 0, ""});
  return report;
}

/// What a quick test that was passed holds for.
std::string tested(const Device& device) {
  const DeviceInfo& info = device.info();
  const nlohmann::json owner{{"device", info.name},
                             {"platform", info.platform_name},
                             {"driver", info.driver_version},
                             {"kernels", device::kernels_hash()},
                             {"layout", to_string(device.layout())},
                             {"tuning", to_json(device.tuning(Precision::single))}};
  return owner.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace) + "\n";
}

/// Empty where there is no place for it.
std::filesystem::path passed_file(const std::string& tested) {
  base::FnvHash hash;
  hash.add(tested);
  try {
    return device::cache_folder() / fmt::format("passed-{}.json", hash.text());
  } catch (const Error&) {
    return {};
  }
}

bool has_passed_before(const std::filesystem::path& file, const std::string& tested) {
  constexpr std::uint64_t kLargestFile = 1 << 16;
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored)) return false;
  try {
    return base::read_text_file(file, "result of a self-test", kLargestFile) == tested;
  } catch (const InputError&) {
    return false;
  }
}

/// Where it cannot be written, the next process tests again.
void keep_pass(const std::filesystem::path& file, const std::string& tested) {
  if (file.empty()) return;
  std::error_code failed;
  std::filesystem::create_directories(file.parent_path(), failed);
  try {
    base::write_file(file, tested);
  } catch (const OutputError&) {
  }
}

}  // namespace

bool SelfTestReport::has_passed() const {
  return !checks.empty() && std::ranges::all_of(checks, &ProgramCheck::has_passed);
}

std::vector<ProgramCheck> self_test_plan(const Device& device) {
  std::vector<ProgramCheck> checks;
  for (const PlannedCheck& plan : planned(device.info())) checks.push_back(without_result(plan));
  return checks;
}

ProgramCheck self_test_check(const Device& device, std::size_t number) {
  const auto plan = planned(device.info());
  if (number >= plan.size()) {
    throw OptionError("number", fmt::format("is {}; give one below {}", number, plan.size()));
  }
  return run(plan[number], device);
}

SelfTestReport self_test(const Device& device, const ProgressMonitor& monitor) {
  return run_all(planned(device.info()), device, monitor);
}

SelfTestReport quick_self_test(const Device& device, const ProgressMonitor& monitor) {
  auto plan = planned(device.info());
  std::erase_if(plan, [](const PlannedCheck& one) {
    return !one.check->is_quick || one.precision != Precision::single;
  });
  return run_all(plan, device, monitor);
}

std::optional<SelfTestReport> first_self_test(const Device& device,
                                              const ProgressMonitor& monitor) {
  const std::string owner = tested(device);
  const auto file = passed_file(owner);
  if (has_passed_before(file, owner)) return std::nullopt;
  SelfTestReport report = quick_self_test(device, monitor);
  if (report.has_passed()) keep_pass(file, owner);
  return report;
}

nlohmann::json to_json(const ProgramCheck& c) {
  return {{"program", c.program},
          {"precision", to_string(c.precision)},
          {"passed", c.has_passed()},
          {"built", c.is_built},
          {"compared", c.compared},
          {"difference",
           std::isfinite(c.difference) ? nlohmann::json(c.difference) : nlohmann::json(nullptr)},
          {"tolerance", c.tolerance},
          {"problem", c.problem.empty() ? nlohmann::json(nullptr) : nlohmann::json(c.problem)}};
}

nlohmann::json to_json(const SelfTestReport& report) {
  nlohmann::json checks = nlohmann::json::array();
  for (const ProgramCheck& check : report.checks) checks.push_back(to_json(check));
  return {
      {"layout", to_string(report.layout)}, {"passed", report.has_passed()}, {"programs", checks}};
}

}  // namespace qjulia
