#include "profile/code_sampler.hpp"

#include "profile/disassembly.hpp"

#if defined(__linux__) && defined(__x86_64__)
#include <dlfcn.h>
#include <ucontext.h>

#include <array>
#include <atomic>
#include <csignal>
#include <ctime>
#include <filesystem>
#include <vector>
#endif

namespace qjulia::profiling {
namespace {

/// Nanoseconds of each thread's CPU time between its samples, in step with nothing else; so many
/// that the log lasts two minutes.
long sampling_period(std::size_t threads) { return 997'000 * static_cast<long>((threads + 1) / 2); }

}  // namespace

#if defined(__linux__) && defined(__x86_64__)
namespace {

/// Where threads were, filled by a signal handler, which may neither lock nor allocate. There is
/// one, for as long as the program runs: a handler may be late.
struct SampleLog {
  static constexpr std::size_t kMost = std::size_t{1} << 18;  // two minutes
  std::array<std::atomic<std::uint64_t>, kMost> addresses{};
  std::atomic<std::size_t> count = 0;
  std::atomic<bool> is_in_use = false;  ///< by a sampler
};
SampleLog samples_taken;

void take_sample(int /*signal*/, siginfo_t* /*info*/, void* context) {
  const std::size_t at = samples_taken.count.fetch_add(1);
  if (at >= SampleLog::kMost) return;
  const auto* const interrupted = static_cast<const ucontext_t*>(context);
  samples_taken.addresses[at] = static_cast<std::uint64_t>(interrupted->uc_mcontext.gregs[REG_RIP]);
}

/// Lets SIGPROF take samples, from now on: a signal that comes late would end the process
/// otherwise. @return false where the program uses that signal itself.
bool handle_signal() {
  struct sigaction now {};
  ::sigaction(SIGPROF, nullptr, &now);
  if ((now.sa_flags & SA_SIGINFO) != 0 && now.sa_sigaction == take_sample) return true;
  if ((now.sa_flags & SA_SIGINFO) != 0 || now.sa_handler != SIG_DFL) return false;
  struct sigaction action {};
  action.sa_sigaction = take_sample;
  action.sa_flags = SA_SIGINFO | SA_RESTART;
  return ::sigaction(SIGPROF, &action, nullptr) == 0;
}

/// The kernel whose file this is: PoCL's are …/KERNEL/SIZES/KERNEL.so. Empty for other files.
std::string kernel_of(const std::filesystem::path& file) {
  const std::string name = file.stem().string();
  const bool is_kernel =
      file.extension() == ".so" && file.parent_path().parent_path().filename().string() == name;
  return is_kernel ? name : std::string();
}

}  // namespace

struct CodeSampler::Impl {
  std::vector<timer_t> timers;
  bool has_log = false;

  explicit Impl(const std::vector<int>& threads) {
    has_log = !samples_taken.is_in_use.exchange(true);
    if (!has_log) return;
    for (std::atomic<std::uint64_t>& address : samples_taken.addresses) address = 0;
    samples_taken.count = 0;
    const long period = sampling_period(threads.size());
    const auto all = static_cast<long>(threads.size());
    long first = 0;
    for (const int thread : threads) {
      sigevent event{};
      event.sigev_notify = SIGEV_THREAD_ID;
      event.sigev_signo = SIGPROF;
      event._sigev_un._tid = thread;
      timer_t timer{};
      if (::timer_create(cpu_clock_of(thread), &event, &timer) != 0) continue;
      timers.push_back(timer);
      // Threads that do a share of a period each are seen too.
      const itimerspec every{{0, period}, {0, period * ++first / all}};
      ::timer_settime(timer, 0, &every, nullptr);
    }
  }
  ~Impl() {
    stop();
    if (has_log) samples_taken.is_in_use = false;
  }
  void stop() {
    for (timer_t timer : timers) ::timer_delete(timer);
    timers.clear();
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
};

CodeSampler::CodeSampler(const std::shared_ptr<const WorkerClock>& clock) {
  if (clock && handle_signal()) impl_ = std::make_unique<Impl>(clock->threads());
}

bool CodeSampler::is_sampling() const { return impl_ && !impl_->timers.empty(); }

KernelMixes CodeSampler::mixes() const {
  if (!impl_ || !impl_->has_log) return {};
  impl_->stop();
  std::map<std::string, AddressCounts> by_file;
  const std::size_t count = std::min(samples_taken.count.load(), SampleLog::kMost);
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint64_t address = samples_taken.addresses[i];
    Dl_info library{};
    // NOLINTNEXTLINE(performance-no-int-to-ptr): an address is what the system's call takes
    if (::dladdr(reinterpret_cast<const void*>(address), &library) == 0) continue;
    if (library.dli_fname == nullptr || kernel_of(library.dli_fname).empty()) continue;
    ++by_file[library.dli_fname][address - reinterpret_cast<std::uint64_t>(library.dli_fbase)];
  }
  KernelMixes found;
  found.sees_kernels = !by_file.empty();
  constexpr std::size_t kFewest = 8;
  for (const auto& [file, samples] : by_file) {
    std::size_t all = 0;
    for (const auto& [address, times] : samples) all += times;
    // Of several builds of a kernel, the one that took most of the time.
    const std::string kernel = kernel_of(file);
    const auto other = found.mixes.find(kernel);
    if (all < kFewest || (other != found.mixes.end() && other->second.samples >= all)) continue;
    Disassembly code = disassembled(file);
    if (!code.problem.empty()) {
      found.problem = std::move(code.problem);
      continue;
    }
    if (const auto mix = instruction_mix(code.text, samples)) {
      found.mixes.insert_or_assign(kernel, *mix);
    }
  }
  if (!found.mixes.empty()) found.problem.clear();
  return found;
}
#else
struct CodeSampler::Impl {};
CodeSampler::CodeSampler(const std::shared_ptr<const WorkerClock>& /*clock*/) {}
bool CodeSampler::is_sampling() const { return false; }
KernelMixes CodeSampler::mixes() const { return {}; }
#endif

CodeSampler::~CodeSampler() = default;

KernelMixes sampled_code(const std::shared_ptr<const WorkerClock>& clock,
                         const std::function<void()>& run) {
  constexpr int kMostRuns = 20;
  const CodeSampler sampler(clock);
  if (!sampler.is_sampling()) return {};
  // 300 samples or so, however many threads share the time.
  const double cpu_seconds =
      300 * 1e-9 * static_cast<double>(sampling_period(clock->threads().size()));
  const double before = clock->seconds();
  for (int i = 0; i < kMostRuns && clock->seconds() - before < cpu_seconds; ++i) run();
  return sampler.mixes();
}

}  // namespace qjulia::profiling
