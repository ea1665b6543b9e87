#pragma once
/// Where and by which program a profile was measured.

#include <nlohmann/json.hpp>
#include <string>

#include "describe/job.hpp"

namespace qjulia::tools {

/// The commit that was checked out when it was built, with "-dirty" behind it where files differed
/// from it; empty where that is not known.
std::string build_commit();

/// The compiler, its version, the build's type and flags, without folders of the machine that built
/// it.
std::string build_flags();

/// Program, version, commit, build, UTC date and load average. @param with_host the host's name
/// too.
nlohmann::json run_facts(bool with_host);
/// The same with the job, which has the hashes of its inputs.
nlohmann::json run_facts(const Job& job, bool with_host);

}  // namespace qjulia::tools
