#pragma once
/// qjulia profile --against: this program and another build of it, profiled in turns.

#include <string>
#include <vector>

#include "benchmark/profile_comparison.hpp"
#include "session.hpp"

namespace qjulia::tools {

struct AgainstArguments {
  std::string other;               ///< the other build's program, the older one
  std::vector<std::string> words;  ///< that both get after 'profile'
  bool names_kernels = false;      ///< whether these choose kernels already
  double seconds = 300;            ///< after which it ends, decided or not
  benchmark::ComparisonOptions comparison;
};

/// @return as compare_profiles (profile_compare.hpp).
/// @throws InputError when either program does not profile; Interrupted
int profile_against(const AgainstArguments& arguments, Session& session);

}  // namespace qjulia::tools
