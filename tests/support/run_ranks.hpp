#pragma once
/// Runs the command under mpirun.

#include <map>
#include <string>
#include <vector>

#include "process.hpp"

namespace qjulia::test {

/// @param command of each rank; the environment's QJULIA is the program.
inline ProcessResult run_ranks(int ranks, const std::vector<std::string>& command,
                               RunOptions options = {}) {
  options.environment.merge(std::map<std::string, std::string>{
      {"OMPI_ALLOW_RUN_AS_ROOT", "1"},
      {"OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1"},
      {"OMPI_MCA_rmaps_base_oversubscribe", "1"},                   // Open MPI 4
      {"PRTE_MCA_rmaps_default_mapping_policy", ":oversubscribe"},  // and 5
      {"QJULIA", QJULIA_COMMAND}});
  std::vector<std::string> all = {QJULIA_MPIEXEC, "-np", std::to_string(ranks)};
  all.insert(all.end(), command.begin(), command.end());
  return run(all, options);
}

}  // namespace qjulia::test
