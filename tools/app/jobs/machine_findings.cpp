#include "jobs/machine_findings.hpp"

#include <fmt/format.h>

#include <iterator>

#include "console/device_obstacles.hpp"
#include "jobs/session.hpp"

namespace qjulia::tools {

std::vector<base::Finding> machine_findings() {
  std::vector<base::Finding> found = base::surroundings();
  if (const std::string obstacle = limit_obstacle(); !obstacle.empty()) {
    found.push_back({"limit", "", obstacle});
    return found;  // drivers must not be asked
  }
  for (const DeviceInfo& d : list_devices()) {
    if (d.same_as.empty()) continue;
    const std::string id = fmt::format("{}:{}", d.platform, d.index);
    found.push_back({"same-device", id,
                     fmt::format("{} on '{}' is the same GPU as {}, which is used instead because "
                                 "its platform is preferred; '--device {}' still chooses this one",
                                 describe(d), d.platform_name, d.same_as, id)});
  }
  return found;
}

std::vector<base::Finding> waiting_findings(const DeviceInfo& device, const WaitTime& waited) {
  constexpr double kLeast = 0.1;  // s, so that there is something to judge by
  const double awake = waited.seconds - waited.slept_seconds;
  if (awake < kLeast || waited.processor_seconds < 0.5 * awake) return {};
  if (device.kind == DeviceKind::cpu) return {};  // it may compute in the thread that waits
  return {{"waiting", "",
           fmt::format("the driver keeps a core busy while it waits: {}. The program sleeps for "
                       "most of the time that launches are known to take",
                       describe(waited))}};
}

std::vector<base::Finding> driver_findings(const Device& device, const DriverFacts& facts) {
  if (device.layout() == Layout::cpu || !facts.may_miscompile_barriers) return {};
  return {{"barriers", "",
           fmt::format("PoCL {} compiles kernels whose work-items wait for one another rightly or "
                       "wrongly by chance, so none do: in this layout the gradient of iterates and "
                       "the Gauss-Newton matrix are slower than on a GPU. The layout 'cpu', which "
                       "is the fast one here, has no such kernels",
                       facts.pocl)}};
}

nlohmann::json to_json(const std::vector<base::Finding>& findings) {
  nlohmann::json all = nlohmann::json::array();
  for (const auto& [kind, path, text] : findings) {
    all.push_back({{"kind", kind},
                   {"path", path.empty() ? nlohmann::json() : nlohmann::json(path)},
                   {"text", text}});
  }
  return all;
}

std::string findings_text(const std::vector<base::Finding>& findings) {
  std::string text;
  for (const base::Finding& finding : findings) {
    text += fmt::format("{:9} {}\n", finding.kind + ":", finding.text);
  }
  return text;
}

}  // namespace qjulia::tools
