#include "profile/work_counter.hpp"

namespace qjulia::profiling {
namespace {

double pairs(const LaunchSize& size) {
  return static_cast<double>(size.parts) * static_cast<double>(size.terms) *
         static_cast<double>(size.points);
}

}  // namespace

void WorkCounter::launched(const device::Launch& launch) {
  const std::scoped_lock lock(counting_);
  KernelWork& all = work_[std::string(launch.kernel)];
  const bool is_double = launch.precision == Precision::dbl;
  // One that runs in both precisions is measured against the limit of single precision.
  all.is_double = is_double && (all.launches == 0 || all.is_double);
  ++all.launches;
  all.slots += launch.work.slots;
  all.bytes += launch.work.reals * static_cast<double>(device::real_bytes(launch.precision));
  all.at_most = all.at_most || launch.work.at_most;
  const LaunchSize& size = launch.work.size;
  if (size.terms == 0) return;
  if (!all.sizes) all.sizes = {size, size};
  if (pairs(size) < pairs(all.sizes->least)) all.sizes->least = size;
  if (pairs(size) > pairs(all.sizes->most)) all.sizes->most = size;
}

void WorkCounter::did(std::string_view kernel, double slots) {
  const std::scoped_lock lock(counting_);
  work_[std::string(kernel)].slots += slots;
}

std::map<std::string, KernelWork> WorkCounter::work() const {
  const std::scoped_lock lock(counting_);
  return {work_.begin(), work_.end()};
}

void WorkCounter::reset() {
  const std::scoped_lock lock(counting_);
  work_.clear();
}

}  // namespace qjulia::profiling
