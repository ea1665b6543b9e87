#pragma once
/// Profiles of several builds or drivers on one page.

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace qjulia::benchmark {

struct NamedProfile {
  std::string name;       ///< of its file
  nlohmann::json report;  ///< of `qjulia profile measure --json`
};

/// A page without other files: the reports in the order of their dates, what changed between each
/// and the one before, the roofline and the verdicts of the last, and the time of each kernel.
/// @throws InputError naming the file that is no such report
std::string profile_page(std::vector<NamedProfile> profiles);

}  // namespace qjulia::benchmark
