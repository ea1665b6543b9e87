#include "jobs/run_facts.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <ctime>

#include "qjulia/base/version.hpp"

namespace qjulia::tools {

nlohmann::json run_facts(bool with_host) {
  const std::time_t now = std::time(nullptr);
  nlohmann::json load = nlohmann::json::array();
  std::array<double, 3> loads{};
  if (::getloadavg(loads.data(), static_cast<int>(loads.size())) == 3) load = loads;
  nlohmann::json facts{
      {"program", "qjulia"},
      {"version", version()},
      {"commit", build_commit().empty() ? nlohmann::json() : nlohmann::json(build_commit())},
      {"build", build_flags()},
      {"date", fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(now))},
      {"load_average", load}};
  if (with_host) {
    std::array<char, 256> host{};
    if (::gethostname(host.data(), host.size() - 1) == 0) facts["host"] = host.data();
  }
  return facts;
}

nlohmann::json run_facts(const Job& job, bool with_host) {
  nlohmann::json facts = run_facts(with_host);
  facts["job"] = to_json(job);
  return facts;
}

}  // namespace qjulia::tools
