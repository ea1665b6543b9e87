#include "profile/kernel_counter.hpp"

namespace qjulia::profiling {

/// Counts from its making to its end.
class KernelCounter::Alone {
 public:
  Alone(KernelCounter& counter, std::string_view kernel)
      : counter_(counter), kernel_(kernel), lock_(counter.running_) {
    if (counter_.events_ != nullptr) before_ = counter_.events_->read();
  }
  ~Alone() {
    if (counter_.events_ == nullptr) return;
    const auto counts = counter_.events_->between(before_, counter_.events_->read());
    const std::scoped_lock lock(counter_.keeping_);
    for (const auto& [name, count] : counts) counter_.kernels_[kernel_].events[name] += count;
  }
  Alone(const Alone&) = delete;
  Alone& operator=(const Alone&) = delete;

 private:
  KernelCounter& counter_;
  std::string kernel_;
  std::unique_lock<std::mutex> lock_;
  ProcessEvents::Reading before_;
};

std::shared_ptr<void> KernelCounter::alone(std::string_view kernel) {
  return std::make_shared<Alone>(*this, kernel);
}

void KernelCounter::launched(const device::Launch& launch) {
  const std::scoped_lock lock(keeping_);
  const auto [at, is_new] = kernels_.try_emplace(std::string(launch.kernel));
  if (is_new) at->second.resources = launch.resources();
}

std::map<std::string, KernelCounter::Kernel, std::less<>> KernelCounter::kernels() const {
  const std::scoped_lock lock(keeping_);
  return kernels_;
}

void KernelCounter::reset() {
  const std::scoped_lock lock(keeping_);
  for (auto& [name, kernel] : kernels_) kernel.events.clear();
}

}  // namespace qjulia::profiling
