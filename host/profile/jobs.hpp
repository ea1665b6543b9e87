#pragma once
/// The jobs that `profile` times, each with the kernels that it launches.

#include <functional>
#include <stop_token>
#include <string>
#include <vector>

#include "profile/workload.hpp"
#include "qjulia/profile/profile.hpp"

namespace qjulia::profiling {

/// What a job asks for, where that is known.
struct Cost {
  double slots = 0;  ///< for one factor at one sample (cost.hpp)
  double reals = 0;  ///< in the whole job
};

struct Job {
  std::string name;
  int iterations = 1;
  std::size_t samples = 0;
  double iterates = 0;  ///< factor iterations a sample and factor that really run; 0: not known
  Cost cost;
  std::vector<std::string> kernels;  ///< that it launches, those of other jobs too
  std::function<void(const std::stop_token&)> run;
};

/// Whether a name fits any of the patterns, in which * stands for any letters and ? for one.
bool fits_any(const std::string& name, const std::vector<std::string>& patterns);

/// Whether options ask for all jobs, and for rows of single kernels beside them.
bool wants_all_jobs(const ProfileOptions& options);

/// The jobs that the options ask for, in their order. Their data is on the device from now on.
/// @param left_out gets what cannot be run for this map, and why.
std::vector<Job> jobs_of(const Device& device, const ProfileOptions& options,
                         std::vector<std::string>& left_out);

}  // namespace qjulia::profiling
