#pragma once
/// What a context holds, for the files that share its work: memory (context_memory.cpp), kernels
/// (context_kernels.cpp), its queue (context_queue.cpp) and OpenCL's own handles (handles.cpp).
/// Included by this room's sources only.

#include <unistd.h>

#include <algorithm>
#include <map>
#include <memory>
#include <mutex>
#include <new>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "device/context.hpp"
#include "device/device_clock.hpp"
#include "device/launch_sizer.hpp"
#include "device/opencl.hpp"
#include "device/patient_wait.hpp"
#include "device/program_builder.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia::device {

/// Which of this process's queues this is: the least number, from 0, that no other has.
class QueueNumber {
 public:
  QueueNumber() {
    const std::lock_guard lock(taken().mutex);
    while (!taken().numbers.insert(value_).second) ++value_;
  }
  ~QueueNumber() {
    const std::lock_guard lock(taken().mutex);
    taken().numbers.erase(value_);
  }
  QueueNumber(const QueueNumber&) = delete;
  QueueNumber& operator=(const QueueNumber&) = delete;

  int value() const { return value_; }

 private:
  struct Taken {
    std::mutex mutex;
    std::set<int> numbers;
  };
  static Taken& taken() {
    static Taken instance;
    return instance;
  }

  int value_ = 0;
};

/// How many bytes a context's buffers take. It outlives the context where a buffer does.
struct AllocatedBytes {
  /// Buffers may end in any thread.
  std::atomic<std::size_t> now = 0, peak = 0;
  std::shared_ptr<Trace> trace{};  ///< records changes; null: none is kept
  Trace::Row row = Trace::Row::device;

  void add(std::size_t bytes) {
    const std::size_t all = now += bytes;
    std::size_t most = peak;
    while (most < all && !peak.compare_exchange_weak(most, all)) continue;
    tell();
  }
  /// If memory runs out, the trace lacks this change.
  void remove(std::size_t bytes) noexcept {
    now -= bytes;
    try {
      tell();
    } catch (const std::bad_alloc&) {
      return;
    }
  }
  void tell() const {
    if (trace) trace->add_memory(row, Trace::Clock::now(), now);
  }
};

struct Memory::Handle {
  cl::Buffer buffer;
  std::size_t bytes = 0;  ///< counted in `allocated`
  std::shared_ptr<AllocatedBytes> allocated{};

  Handle() = default;
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  ~Handle() {
    if (allocated) allocated->remove(bytes);
  }
};

struct Kernel::Handle {
  cl::Kernel kernel;
  std::string name;
  cl_uint argument_count = 0;
  int lane_width = 1;
  Precision precision = Precision::single;
  std::size_t group = 1;  ///< work-items of a group where a launch does not say
  LaunchSizer sizer;
  LaunchTime launch_time;
};

struct Context::Impl {
  DeviceInfo info;
  pid_t process = ::getpid();  ///< in which the context was opened
  cl::Device device;
  cl::Context context;
  cl::CommandQueue queue;
  std::shared_ptr<AllocatedBytes> allocated = std::make_shared<AllocatedBytes>();
  /// Keyed by files and options. The device and its driver need no key here, since a context has
  /// one device; what is kept on disk has them in its keys.
  std::map<std::string, cl::Program> programs;
  std::map<std::string, Kernel> kernels;

  struct Pending {
    std::shared_ptr<Kernel::Handle> kernel;
    double cost;         ///< 0: not said
    double units;        ///< the same, or work-items
    double least, most;  ///< seconds that it is expected to take
    cl::Event event;
    Trace::Call call;  ///< that launched it
  };
  std::vector<Pending> pending;
  /// Copies of data that queued writes have yet to read.
  std::vector<std::vector<std::byte>> copied;
  std::size_t copied_bytes = 0;
  std::map<std::string, KernelTime> times;
  /// Whether events carry times: known after the first launch.
  std::optional<bool> events_have_times;
  std::shared_ptr<Trace> trace;
  Trace::Row row = Trace::Row::device;
  DeviceClock clock;
  QueueNumber number;
  std::shared_ptr<WaitTotal> waited;
  PatientWait patient_wait;
  ProgramBuilder builder;

  /// @param sharing whose waits are counted with this one's; null: none.
  Impl(const DeviceInfo& described, const Impl* sharing)
      : info(described),
        waited(sharing != nullptr ? sharing->waited : std::make_shared<WaitTotal>()),
        patient_wait(info.kind != DeviceKind::cpu, waited),
        builder(info) {}

  /// Makes a call that returns once the queue is empty.
  template <class Call>
  cl_int wait(const Call& call) {
    return patient_wait([&] { queue.flush(); }, call);
  }

  /// Call it before anything is asked of the queue.
  void expect_own_process(const std::string& call) const {
    device::expect_own_process(process, info.name, call);
  }
  void expect(cl_int code, const std::string& call) const {
    if (code != CL_SUCCESS) throw DeviceError(info.name, call, code);
  }
  void use_large_pages(const cl::Buffer& buffer, std::size_t bytes) const;
  std::string build_line(const BuildOptions& options) const {
    return builder.line(options, number.value());
  }
  /// Waits until the queue is empty.
  void collect_times();
  /// Like `collect_times()`, but does not wait where every launch has run.
  void collect_finished();
  /// Collects the times of the first `count` launches, all of which have run. A launch that has
  /// failed stays pending, so that every later wait throws its error again: see `Context`.
  void collect_times(std::size_t count);
  /// @throws DeviceError when the launch has failed.
  void collect_time(const Pending& launch);
  /// Waits until a launch of so many seconds may be queued.
  void make_room(double seconds);
  void add_time(const Pending& launch, std::chrono::nanoseconds length);
};

}  // namespace qjulia::device
