#include "qjulia/device/driver_facts.hpp"

#include <stdlib.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <string_view>

#include "base/text.hpp"
#include "device/context.hpp"
#include "device/opencl.hpp"
#include "device/program_builder.hpp"
#include "device/quirks.hpp"

namespace qjulia {
namespace {

bool is_of_drivers(std::string_view variable) {
  constexpr std::array<std::string_view, 13> kBeginnings = {
      "POCL_", "OCL_",  "OPENCL_", "CL_",   "QJULIA_", "RUSTICL_", "LP_",
      "MESA_", "CUDA_", "HSA_",    "ROCR_", "GPU_",    "NEO"};
  return std::ranges::any_of(
      kBeginnings, [&](std::string_view beginning) { return variable.starts_with(beginning); });
}

std::map<std::string, std::string> environment_of_drivers() {
  std::map<std::string, std::string> found;
  for (char** entry = environ; *entry != nullptr; ++entry) {
    const std::string_view text(*entry);
    const std::size_t end = text.find('=');
    if (end == std::string_view::npos || !is_of_drivers(text.substr(0, end))) continue;
    found.emplace(base::to_utf8(text.substr(0, end)), base::to_utf8(text.substr(end + 1)));
  }
  return found;
}

/// The word after `name` in a platform's version; empty where it is not named.
std::string version_after(const std::string& text, const std::string& name) {
  const std::size_t at = text.find(name + ' ');
  if (at == std::string::npos) return {};
  const std::size_t begin = at + name.size() + 1;
  return text.substr(begin, text.find_first_of(" ,", begin) - begin);
}

}  // namespace

DriverFacts driver_facts(const Device& device) {
  const DeviceInfo& info = device.info();
  DriverFacts facts;
  facts.is_pocl = device::is_pocl(info);
  const auto platforms = device::platforms();
  if (const auto number = static_cast<std::size_t>(info.platform); number < platforms.size()) {
    facts.platform_version = platforms[number].getInfo<CL_PLATFORM_VERSION>();
  }
  facts.llvm = version_after(facts.platform_version, "LLVM");
  const device::ProgramBuilder builder(info);
  for (const Precision precision : kPrecisions) {
    if (precision == Precision::dbl && !info.has_double) continue;
    facts.build_flags[precision] = builder.line(
        {.lane_width = device.tuning(precision).lane_width, .precision = precision, .defines = {}},
        0);
  }
  if (facts.is_pocl) {
    facts.pocl = version_after(facts.platform_version, "PoCL");
    const char* const extra = ::getenv("POCL_EXTRA_BUILD_FLAGS");
    if (extra != nullptr) facts.extra_build_flags = base::to_utf8(extra);
  }
  facts.may_miscompile_barriers = device::may_miscompile_barriers(info);
  facts.environment = environment_of_drivers();
  return facts;
}

nlohmann::json to_json(const DriverFacts& facts) {
  const auto text_or_null = [](const std::string& text) {
    return text.empty() ? nlohmann::json() : nlohmann::json(text);
  };
  nlohmann::json flags;
  for (const auto& [precision, line] : facts.build_flags) flags[to_string(precision)] = line;
  return {{"platform_version", base::to_utf8(facts.platform_version)},
          {"pocl", text_or_null(facts.pocl)},
          {"llvm", text_or_null(facts.llvm)},
          {"build_flags", flags},
          {"extra_build_flags", text_or_null(facts.extra_build_flags)},
          {"may_miscompile_barriers", facts.may_miscompile_barriers},
          {"environment", nlohmann::json(facts.environment)}};
}

}  // namespace qjulia
