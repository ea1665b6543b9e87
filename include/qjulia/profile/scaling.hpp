#pragma once
/// How the cost of an evaluation grows with its size.

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "qjulia/profile/profile.hpp"

namespace qjulia {

/// One energy with its gradient.
struct ScalingPoint {
  int iterations = 1;
  std::size_t samples = 0;
  std::size_t factors = 0;
  double seconds = 0;            ///< on the device, the fastest run
  std::size_t device_bytes = 0;  ///< allocated on the device at most
};

/// seconds ∝ samples^a · factors^b, by least squares of the logarithms.
struct ScalingLaw {
  int iterations = 1;
  double samples_exponent = 0;
  double factors_exponent = 0;
  double worst_ratio = 1;  ///< between a point's time and the law's, 1 or more
};

struct ScalingReport {
  DeviceInfo device;
  std::vector<ScalingPoint> points;
  std::vector<ScalingLaw> laws;
};

/// The grid that is measured: every number of samples with every number of factors.
struct ScalingOptions {
  std::vector<std::size_t> samples{15'625, 125'000, 912'673, 7'189'057};  ///< 25³, 50³, 97³, 193³
  std::vector<std::size_t> factors{83, 166, 331, 662, 1324};
  std::vector<int> iterations{1, 4};
  /// Multiply-adds, multiplications and divisions of the largest evaluation, some seconds on two
  /// cores: what is larger is left out.
  double most_slots = 3e11;
  std::uint64_t seed = 1;
  Precision precision = Precision::single;
  void validate() const;  ///< @throws OptionError
};

ScalingReport measure_scaling(const Device& device, const ScalingOptions& options,
                              const ProgressMonitor& monitor = {});

/// The law that points of one number of iterations follow. @throws InputError unless three of them
/// are not on one line.
ScalingLaw fit_law(const std::vector<ScalingPoint>& points);

nlohmann::json to_json(const ScalingReport& report);
/// A line for each point under a line of names.
std::string to_csv(const ScalingReport& report);

}  // namespace qjulia
