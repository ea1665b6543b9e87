#pragma once
/// The fixed work that kernels are timed with and settings are tried with, and its stopwatch.

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "energy/evaluator.hpp"
#include "energy/samples.hpp"
#include "profile/roof.hpp"
#include "profile/worker_clock.hpp"
#include "qjulia/device/device.hpp"
#include "qjulia/map/field.hpp"
#include "qjulia/map/map.hpp"
#include "qjulia/mesh/mesh.hpp"
#include "qjulia/profile/profile.hpp"

namespace qjulia::profiling {

struct KernelSeconds {
  double device = 0;  ///< sum over all kernels that ran
  double wall = 0;
};

/// Runs `work` and waits for the device.
KernelSeconds timed(const Device& device, const std::function<void()>& work);

/// The seconds of each kernel that `work` launches, on all queues of the device.
struct KernelsRun {
  struct Kernel {
    std::uint64_t launches = 0;
    Spent spent;
  };
  std::map<std::string, Kernel> kernels;
  Spent all;  ///< sum over all kernels
  double wall = 0;
};
/// @param clock of the device's threads; null: CPU seconds are not measured.
KernelsRun timed_by_kernel(const Device& device, const std::shared_ptr<const WorkerClock>& clock,
                           const std::function<void()>& work);

struct Workload {
  energy::Samples samples;
  Map map;
  Box box{Eigen::Vector3d::Constant(-1.5), Eigen::Vector3d::Constant(1.5)};  ///< of the samples
};
/// The map that options give, or one that is made up.
Workload make_workload(const ProfileOptions& options);

/// A sphere of radius 1 by latitude and longitude, 4 · rings · (rings − 1) triangles.
TriangleMesh make_sphere(int rings);

/// An escape radius that no orbit of the workload reaches.
constexpr double kNoEscape = kLargestEscape;

/// An evaluator of the energy of so many iterates. Every orbit runs all of them.
std::unique_ptr<energy::Evaluator> make_evaluator(const Device& device, const Workload& work,
                                                  int iterations, Precision precision);

/// What settings are tried with.
enum class TuneJob { energy, gradient, orbit_energy, orbit_gradient, gauss_newton };

const char* to_string(TuneJob job);

/// Largest difference over the largest number. NaN differs infinitely.
double largest_difference(const std::vector<double>& a, const std::vector<double>& b);

/// The jobs over one workload with one device's settings.
class TuneBench {
 public:
  TuneBench(const Device& device, const Workload& work, Precision precision);

  /// What the job computes, as numbers to compare: the energy, the gradient or the matrix.
  std::vector<double> run(TuneJob job);
  /// Seconds on the device.
  double time(TuneJob job);
  const Device& device() const { return device_; }

 private:
  Device device_;
  const Map& map_;
  std::unique_ptr<energy::Evaluator> potential_, orbit_;
};

}  // namespace qjulia::profiling
