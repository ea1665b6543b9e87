#include "profile/worker_clock.hpp"

#include <algorithm>
#include <ctime>
#include <string>
#ifdef __linux__
#include <unistd.h>

#include <fstream>
#endif

#include "profile/process_events.hpp"

namespace qjulia::profiling {

#ifdef __linux__
clockid_t cpu_clock_of(int thread) {
  // Linux's number of that clock; pthread_getcpuclockid would need the thread's handle.
  constexpr unsigned kOfThread = 4, kScheduled = 2;
  return static_cast<clockid_t>(~static_cast<unsigned>(thread) << 3U | kOfThread | kScheduled);
}
#endif

namespace {

double seconds_of(const std::timespec& time) {
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

double seconds_of(std::chrono::nanoseconds time) {
  return 1e-9 * static_cast<double>(time.count());
}

double callers_seconds() {
  std::timespec time{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return seconds_of(time);
}

#ifdef __linux__
/// CPU seconds of a thread of this process; none where it has ended.
std::optional<double> thread_seconds(int thread) {
  std::timespec time{};
  if (::clock_gettime(cpu_clock_of(thread), &time) != 0) return std::nullopt;
  return seconds_of(time);
}

/// Seconds for which a thread of this process was ready and waited for a processor.
std::optional<double> thread_waited(int thread) {
  std::ifstream file("/proc/self/task/" + std::to_string(thread) + "/schedstat");
  double ran = 0, waited = 0;  // nanoseconds
  return file >> ran >> waited ? std::optional(1e-9 * waited) : std::nullopt;
}

int this_thread() { return static_cast<int>(::gettid()); }
#else
std::optional<double> thread_seconds(int) { return std::nullopt; }
std::optional<double> thread_waited(int) { return std::nullopt; }
int this_thread() { return 0; }
#endif

}  // namespace

std::shared_ptr<const WorkerClock> WorkerClock::of(const Device& device,
                                                   const std::function<void()>& probe) {
  if (device.info().kind != DeviceKind::cpu) return nullptr;
  const auto calls = system_event_calls();
  probe();  // the driver starts its threads
  std::map<int, double> before;
  for (const int thread : calls->threads()) before[thread] = thread_seconds(thread).value_or(0);
  const double callers_before = callers_seconds();
  probe();
  const double by_caller = callers_seconds() - callers_before;
  double most = 0;
  std::vector<int> threads;
  for (const int thread : calls->threads()) {
    const auto seconds = thread_seconds(thread);
    if (!seconds || thread == this_thread()) continue;
    most = std::max(most, *seconds - before[thread]);
    threads.push_back(thread);
  }
  // A thread that only waits uses next to nothing.
  constexpr double kComputes = 0.25;
  if (by_caller > kComputes * most) threads.push_back(this_thread());
  if (most == 0 && by_caller == 0) return nullptr;
  return std::shared_ptr<const WorkerClock>(new WorkerClock(std::move(threads)));
}

double WorkerClock::seconds() const {
  const std::scoped_lock lock(reading_);
  double sum = 0;
  for (const int thread : threads_) {
    double& latest = latest_[thread];
    latest = std::max(latest, thread_seconds(thread).value_or(0));
    sum += latest;
  }
  return sum;
}

std::optional<double> WorkerClock::waited_seconds() const {
  double sum = 0;
  for (const int thread : threads_) {
    const auto waited = thread_waited(thread);
    if (!waited) return std::nullopt;
    sum += *waited;
  }
  return sum;
}

WaitedShare::WaitedShare(std::shared_ptr<const WorkerClock> clock) : clock_(std::move(clock)) {
  if (!clock_) return;
  seconds_ = clock_->seconds();
  waited_ = clock_->waited_seconds();
}

std::optional<double> WaitedShare::so_far() const {
  if (!waited_) return std::nullopt;
  const auto now = clock_->waited_seconds();
  if (!now) return std::nullopt;
  const double waited = *now - *waited_, ran = clock_->seconds() - seconds_;
  if (!(waited + ran > 0)) return std::nullopt;
  return std::max(0.0, waited / (waited + ran));
}

CpuSampler::CpuSampler(std::shared_ptr<const WorkerClock> clock) : clock_(std::move(clock)) {
  add_sample();
  thread_ = std::jthread([this](const std::stop_token& end) {
    std::unique_lock lock(adding_);
    while (!ended_.wait_for(lock, end, period_, [&] { return end.stop_requested(); })) add_sample();
  });
}

CpuSampler::~CpuSampler() { thread_.request_stop(), thread_.join(); }

void CpuSampler::add_sample() {
  constexpr std::size_t kMostSamples = 1'000'000;
  samples_.push_back({Trace::Clock::now(), clock_->seconds()});
  if (samples_.size() < kMostSamples) return;
  for (std::size_t i = 0; 2 * i < samples_.size(); ++i) samples_[i] = samples_[2 * i];
  samples_.resize((samples_.size() + 1) / 2);
  period_ *= 2;
}

std::vector<CpuSample> CpuSampler::samples() const {
  const std::scoped_lock lock(adding_);
  std::vector<CpuSample> all = samples_;
  all.push_back({Trace::Clock::now(), clock_->seconds()});
  return all;
}

std::vector<double> cpu_seconds_of(const std::vector<KernelSpan>& kernels,
                                   const std::vector<CpuSample>& samples, unsigned processors) {
  std::vector<double> seconds(kernels.size(), 0);
  if (samples.size() < 2) return seconds;
  std::vector<double> busy(samples.size() - 1, 0);  // kernels' time between a sample and the next
  const auto over_gaps = [&](const KernelSpan& kernel, const auto& take) {
    const auto end = kernel.start + kernel.length;
    const auto next = std::ranges::upper_bound(samples, kernel.start, {}, &CpuSample::time);
    auto gap = static_cast<std::size_t>(next - samples.begin());
    for (gap -= gap > 0 ? 1 : 0; gap < busy.size() && samples[gap].time < end; ++gap) {
      const auto time =
          std::min(end, samples[gap + 1].time) - std::max(kernel.start, samples[gap].time);
      if (time.count() > 0) take(gap, seconds_of(time));
    }
  };
  for (const KernelSpan& kernel : kernels) {
    over_gaps(kernel, [&](std::size_t gap, double time) { busy[gap] += time; });
  }
  for (std::size_t i = 0; i < kernels.size(); ++i) {
    over_gaps(kernels[i], [&](std::size_t gap, double time) {
      const double used = samples[gap + 1].seconds - samples[gap].seconds;
      seconds[i] += std::min(used / busy[gap], double(processors)) * time;
    });
  }
  return seconds;
}

}  // namespace qjulia::profiling
