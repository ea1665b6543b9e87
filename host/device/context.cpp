#include "device/context.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cstring>
#include <mutex>
#include <optional>
#include <set>

#include "base/large_pages.hpp"
#include "device/device_clock.hpp"
#include "device/handles.hpp"
#include "device/kernel_resources.hpp"
#include "device/launch_sizer.hpp"
#include "device/launch_watch.hpp"
#include "device/opencl.hpp"
#include "device/patient_wait.hpp"
#include "device/program_builder.hpp"
#include "device/program_source.hpp"
#include "device/quirks.hpp"
#include "qjulia/error.hpp"

namespace qjulia::device {
namespace {

DeviceTimes times_of(const cl::Event& event) {
  const auto at = [](cl_ulong count) {
    return std::chrono::nanoseconds(static_cast<std::int64_t>(count));
  };
  return {at(event.getProfilingInfo<CL_PROFILING_COMMAND_QUEUED>()),
          at(event.getProfilingInfo<CL_PROFILING_COMMAND_START>()),
          at(event.getProfilingInfo<CL_PROFILING_COMMAND_END>())};
}

double items_of(const Range& range) {
  double items = 1;
  for (const std::size_t side : range.global) items *= static_cast<double>(side);
  return items;
}

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

}  // namespace

/// How many bytes a context's buffers take. It outlives the context where a buffer does.
struct AllocatedBytes {
  std::size_t now = 0, peak = 0;
};

struct Memory::Handle {
  cl::Buffer buffer;
  std::size_t bytes = 0;  ///< counted in `allocated`
  std::shared_ptr<AllocatedBytes> allocated{};

  Handle() = default;
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  ~Handle() {
    if (allocated) allocated->now -= bytes;
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

namespace {

/// Estimated work in a queue, in seconds: drivers fail or screens freeze when there is more.
constexpr double kMostQueued = 1, kMostQueuedBesideScreen = 0.2;
/// Launches in a queue, however short.
constexpr std::size_t kMostPending = 1024;
/// Bytes of a write that is not waited for, since a copy is made; and of all such copies.
constexpr std::size_t kLargestCopy = std::size_t{1} << 20, kMostCopied = std::size_t{1} << 26;

}  // namespace

struct Context::Impl {
  DeviceInfo info;
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
    double work;         ///< 0: not said
    double units;        ///< the same, or work-items
    double least, most;  ///< seconds that it is expected to take
    cl::Event event;
    Trace::Clock::time_point before, after;  ///< around the call that launched it
  };
  std::vector<Pending> pending;
  /// What writes in the queue read from.
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

  /// Calls what comes back when the queue is empty.
  template <class Call>
  cl_int wait(const Call& call) {
    return patient_wait([&] { queue.flush(); }, call);
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
  /// The same where all that was queued has run.
  void collect_finished();
  /// The first so many launches, which have run.
  void collect_times(std::size_t count);
  void collect_time(const Pending& launch);
  /// Waits until a launch of so many seconds may be queued.
  void make_room(double seconds);
  void add_time(const Pending& launch, std::chrono::nanoseconds length);
};

Argument::Argument(const void* value, std::size_t size) : size_(size) {
  std::memcpy(value_.data(), value, size);
}
Argument::Argument(std::int32_t value) : Argument(&value, sizeof value) {}
Argument Argument::real(double value, Precision precision) {
  return precision == Precision::dbl ? of(value) : of(static_cast<float>(value));
}

Context::Context(const DeviceInfo& info, const Context* sharing)
    : impl_(std::make_unique<Impl>(info, sharing == nullptr ? nullptr : sharing->impl_.get())) {
  cl_int code = CL_SUCCESS;
  if (sharing != nullptr) {
    impl_->device = sharing->impl_->device;
    impl_->context = sharing->impl_->context;
  } else {
    const auto all = devices(platforms().at(static_cast<std::size_t>(info.platform)));
    impl_->device = all.at(static_cast<std::size_t>(info.index));
    impl_->context = cl::Context(impl_->device, nullptr, nullptr, nullptr, &code);
    impl_->expect(code, "clCreateContext");
  }
  impl_->queue = cl::CommandQueue(impl_->context, impl_->device, CL_QUEUE_PROFILING_ENABLE, &code);
  impl_->expect(code, "clCreateCommandQueue");
}

Context::Context(const DeviceInfo& info, const Handles& handles)
    : impl_(std::make_unique<Impl>(info, nullptr)) {
  impl_->device = cl::Device(handles.device, true);
  impl_->context = cl::Context(handles.context, true);
  impl_->queue = cl::CommandQueue(handles.queue, true);
  cl_int code = CL_SUCCESS;
  const auto properties = impl_->queue.getInfo<CL_QUEUE_PROPERTIES>(&code);
  impl_->expect(code, "clGetCommandQueueInfo");
  if ((properties & CL_QUEUE_PROFILING_ENABLE) == 0) impl_->events_have_times = false;
}

Context::~Context() {
  if (impl_->queue()) impl_->queue.finish();
}

const DeviceInfo& Context::info() const { return impl_->info; }

/// On a CPU, whose buffers are where the host finds them.
void Context::Impl::use_large_pages(const cl::Buffer& buffer, std::size_t bytes) const {
  constexpr std::size_t kLeast = std::size_t{1} << 22;
  if (info.kind != DeviceKind::cpu || bytes < kLeast) return;
  cl_int code = CL_SUCCESS;
  void* at = queue.enqueueMapBuffer(buffer, CL_TRUE, CL_MAP_WRITE_INVALIDATE_REGION, 0, bytes,
                                    nullptr, nullptr, &code);
  if (code != CL_SUCCESS) return;
  base::use_large_pages(at, bytes);
  expect(queue.enqueueUnmapMemObject(buffer, at), "clEnqueueUnmapMemObject");
}

Memory Context::allocate_bytes(std::size_t bytes) {
  const std::string call = fmt::format("allocating {} bytes", bytes);
  if (bytes > impl_->info.largest_allocation) impl_->expect(CL_INVALID_BUFFER_SIZE, call);
  if (bytes > impl_->info.global_memory -
                  std::min<std::uint64_t>(impl_->allocated->now, impl_->info.global_memory)) {
    impl_->expect(CL_MEM_OBJECT_ALLOCATION_FAILURE, call);
  }
  Memory memory;
  memory.bytes_ = bytes;
  memory.handle_ = std::make_shared<Memory::Handle>();
  cl_int code = CL_SUCCESS;
  // OpenCL has no empty buffer: an empty one of ours holds one unused byte.
  memory.handle_->buffer = cl::Buffer(impl_->context, CL_MEM_READ_WRITE,
                                      std::max<std::size_t>(bytes, 1), nullptr, &code);
  impl_->expect(code, call);
  impl_->use_large_pages(memory.handle_->buffer, bytes);
  memory.handle_->bytes = bytes;
  memory.handle_->allocated = impl_->allocated;
  impl_->allocated->now += bytes;
  impl_->allocated->peak = std::max(impl_->allocated->peak, impl_->allocated->now);
  return memory;
}

std::size_t Context::peak_allocated_bytes() const { return impl_->allocated->peak; }

void Context::reset_peak_allocated_bytes() { impl_->allocated->peak = impl_->allocated->now; }

RealBuffer Context::allocate_real(std::size_t count, Precision precision) {
  return {allocate_bytes(count * real_bytes(precision)), precision};
}

RealBuffer Context::upload_real(std::span<const double> values, Precision precision) {
  RealBuffer buffer = allocate_real(values.size(), precision);
  write(buffer, values);
  return buffer;
}

RealBuffer Context::upload_real(std::span<const float> values) {
  RealBuffer buffer = allocate_real(values.size(), Precision::single);
  write_bytes(buffer, std::as_bytes(values));
  return buffer;
}

void Context::write(const RealBuffer& buffer, std::span<const double> values) {
  if (buffer.precision() == Precision::dbl) {
    write_bytes(buffer, std::as_bytes(values));
    return;
  }
  const std::vector<float> narrow(values.begin(), values.end());
  write_bytes(buffer, std::as_bytes(std::span(narrow)));
}

void Context::read(const RealBuffer& buffer, std::span<double> out) {
  const RealRead one{buffer, out};
  read(std::span(&one, 1));
}

void Context::read(std::span<const RealRead> reads) {
  std::vector<std::vector<float>> narrow;
  std::vector<ByteRead> all;
  for (const RealRead& read : reads) {
    const bool is_narrow = read.from.precision() == Precision::single;
    narrow.emplace_back(is_narrow ? read.to.size() : 0);
    all.push_back({read.from, is_narrow ? std::as_writable_bytes(std::span(narrow.back()))
                                        : std::as_writable_bytes(read.to)});
  }
  read_bytes(all);
  for (std::size_t i = 0; i < reads.size(); ++i) {
    std::ranges::copy(narrow[i], reads[i].to.begin());
  }
}

void Context::read(const RealBuffer& buffer, std::span<float> out) {
  if (buffer.precision() == Precision::single) {
    read_bytes(buffer, std::as_writable_bytes(out));
    return;
  }
  std::vector<double> wide(out.size());
  read_bytes(buffer, std::as_writable_bytes(std::span(wide)));
  std::ranges::transform(wide, out.begin(), [](double x) { return static_cast<float>(x); });
}

void Context::write_bytes(const Memory& memory, std::span<const std::byte> bytes) {
  const std::size_t count = bytes.size();
  if (count > memory.bytes()) throw std::logic_error("write past the end of a device buffer");
  if (count == 0) return;
  const cl::Buffer& to = memory.handle_->buffer;
  impl_->waited->add({.transfers = 1});
  if (count > kLargestCopy) {
    const cl_int code = impl_->wait(
        [&] { return impl_->queue.enqueueWriteBuffer(to, CL_TRUE, 0, count, bytes.data()); });
    impl_->expect(code, "clEnqueueWriteBuffer");
    return;
  }
  if (impl_->copied_bytes + count > kMostCopied) impl_->collect_times();
  auto& copy = impl_->copied.emplace_back(bytes.begin(), bytes.end());
  impl_->copied_bytes += count;
  impl_->expect(impl_->queue.enqueueWriteBuffer(to, CL_FALSE, 0, count, copy.data()),
                "clEnqueueWriteBuffer");
}

void Context::read_bytes(const Memory& memory, std::span<std::byte> bytes) {
  const ByteRead one{memory, bytes};
  read_bytes(std::span(&one, 1));
}

void Context::read_bytes(std::span<const ByteRead> reads) {
  std::vector<const ByteRead*> wanted;
  for (const ByteRead& read : reads) {
    if (read.to.size() > read.from.bytes()) {
      throw std::logic_error("read past the end of a device buffer");
    }
    if (!read.to.empty()) wanted.push_back(&read);
  }
  if (wanted.empty()) return;
  impl_->waited->add({.transfers = wanted.size()});
  const auto enqueue = [&](const ByteRead& read, cl_bool blocking) {
    return impl_->queue.enqueueReadBuffer(read.from.handle_->buffer, blocking, 0, read.to.size(),
                                          read.to.data());
  };
  for (const ByteRead* read : std::span(wanted).first(wanted.size() - 1)) {
    const cl_int code = enqueue(*read, CL_FALSE);
    if (code == CL_SUCCESS) continue;
    impl_->queue.finish();  // the earlier ones write to what the caller may free
    impl_->expect(code, "clEnqueueReadBuffer");
  }
  // In a queue in order the last comes last.
  const cl_int code = impl_->wait([&] { return enqueue(*wanted.back(), CL_TRUE); });
  if (code != CL_SUCCESS && wanted.size() > 1) impl_->queue.finish();
  impl_->expect(code, "clEnqueueReadBuffer");
  impl_->collect_finished();
}

Kernel Context::kernel(const std::string& file, const std::string& name,
                       const BuildOptions& options) {
  const std::string line = impl_->build_line(options);
  std::string program_key = file + '\n' + line;
  for (const auto& [unused, included] : options.files) program_key += '\n' + included;
  const std::string key = name + '\n' + program_key;
  if (const auto found = impl_->kernels.find(key); found != impl_->kernels.end()) {
    return found->second;
  }
  auto program = impl_->programs.find(program_key);
  if (program == impl_->programs.end()) {
    const TraceStage stage(impl_->trace, "build " + file);
    const cl::Program built = impl_->builder.build(impl_->context, impl_->device, file,
                                                   expand_kernel_source(file, options.files), line);
    program = impl_->programs.emplace(program_key, built).first;
  }
  Kernel kernel;
  kernel.handle_ = std::make_shared<Kernel::Handle>();
  Kernel::Handle& handle = *kernel.handle_;
  cl_int code = CL_SUCCESS;
  handle.kernel = cl::Kernel(program->second, name.c_str(), &code);
  impl_->expect(code, fmt::format("creating kernel {} of {}", name, file));
  handle.name = name;
  handle.lane_width = options.lane_width;
  handle.precision = options.precision;
  handle.sizer = LaunchSizer(impl_->info);
  handle.argument_count = handle.kernel.getInfo<CL_KERNEL_NUM_ARGS>();
  handle.group = std::clamp<std::size_t>(std::bit_floor(largest_group(kernel)), 1,
                                         preferred_group_size(impl_->info, options.lane_width));
  impl_->kernels.emplace(key, kernel);
  return kernel;
}

Handles Handles::of(const Context& context) {
  const Context::Impl& impl = *context.impl_;
  return {impl.context(), impl.device(), impl.queue()};
}

cl_mem Handles::of(const Memory& memory) { return memory.handle_->buffer(); }

Memory Handles::borrowed(const Context& context, const char* name, cl_mem buffer,
                         std::size_t bytes) {
  if (buffer == nullptr) throw OptionError(name, "is null; give a buffer");
  const cl::Buffer kept(buffer, true);
  if (kept.getInfo<CL_MEM_TYPE>() != CL_MEM_OBJECT_BUFFER) {
    throw OptionError(name, "is an image; give a buffer");
  }
  if (kept.getInfo<CL_MEM_CONTEXT>()() != context.impl_->context()) {
    throw OptionError(name, "belongs to another context; give a buffer of the device's");
  }
  if (const auto size = kept.getInfo<CL_MEM_SIZE>(); size < bytes) {
    throw OptionError(name, fmt::format("has {} bytes; give at least {}", size, bytes));
  }
  Memory memory;
  memory.bytes_ = bytes;
  memory.handle_ = std::make_shared<Memory::Handle>();
  memory.handle_->buffer = kept;
  return memory;
}

cl_kernel Handles::build(const Context& context, const std::string& source, const std::string& name,
                         const BuildOptions& options) {
  Context::Impl& impl = *context.impl_;
  const std::string line = impl.build_line(options);
  const char* const label = "a source of one's own";
  const cl::Program built = impl.builder.build(
      impl.context, impl.device, label, expand_kernel_text(label, source, options.files), line);
  cl_int code = CL_SUCCESS;
  cl::Kernel kernel(built, name.c_str(), &code);
  if (code == CL_INVALID_KERNEL_NAME) {
    throw InputError(fmt::format("the source has no kernel named '{}'", name));
  }
  impl.expect(code, fmt::format("creating kernel {}", name));
  const cl_kernel given = kernel();
  kernel() = nullptr;  // the caller releases it
  return given;
}

std::size_t Context::largest_group(const Kernel& kernel) const {
  const cl::Kernel& built = kernel.handle_->kernel;
  cl_int code = CL_SUCCESS;
  const std::string call = fmt::format("asking about kernel {}", kernel.handle_->name);
  const auto local = built.getWorkGroupInfo<CL_KERNEL_LOCAL_MEM_SIZE>(impl_->device, &code);
  impl_->expect(code, call);
  if (local > impl_->info.local_memory) return 0;
  const auto group = built.getWorkGroupInfo<CL_KERNEL_WORK_GROUP_SIZE>(impl_->device, &code);
  impl_->expect(code, call);
  return std::min<std::size_t>(group, impl_->info.largest_work_group);
}

void Context::launch(const Kernel& kernel, const Range& range, std::span<const Argument> arguments,
                     double work) {
  auto& handle = *kernel.handle_;
  if (arguments.size() != handle.argument_count) {
    throw std::logic_error(fmt::format("kernel {} takes {} arguments, not {}", handle.name,
                                       handle.argument_count, arguments.size()));
  }
  cl_uint index = 0;
  for (const Argument& argument : arguments) {
    const std::string call = fmt::format("argument {} of kernel {}", index, handle.name);
    if (argument.memory_ == nullptr) {
      impl_->expect(handle.kernel.setArg(index, argument.size_, argument.value_.data()), call);
    } else if (argument.memory_->handle_) {
      impl_->expect(handle.kernel.setArg(index, argument.memory_->handle_->buffer), call);
    } else {
      throw std::logic_error(call + " is an unallocated buffer");
    }
    ++index;
  }
  if (std::ranges::any_of(range.global, [](std::size_t n) { return n == 0; })) return;

  const double units = work > 0 ? work : items_of(range);
  const double most = handle.launch_time.most(units);
  impl_->make_room(most);
  const auto before = Trace::Clock::now();
  cl::Event event;
  const auto enqueue = [&] {
    auto g = range.global;
    auto l = range.local;
    if (l[0] == 0) {
      l = {handle.group, 1, 1};
      g[0] = (g[0] + l[0] - 1) / l[0] * l[0];
    }
    return impl_->queue.enqueueNDRangeKernel(handle.kernel, cl::NullRange,
                                             cl::NDRange(g[0], g[1], g[2]),
                                             cl::NDRange(l[0], l[1], l[2]), nullptr, &event);
  };
  LaunchWatch* const watch = launch_watch();
  const auto alone = watch != nullptr ? watch->alone(handle.name) : nullptr;
  cl_int code = enqueue();
  // Some drivers refuse groups that they said they would take.
  while (means_refused_group(code) && range.local[0] == 0 && handle.group > 1) {
    handle.group /= 2;
    code = enqueue();
  }
  if (code != CL_SUCCESS) {
    throw RefusedLaunch(impl_->info.name, fmt::format("launching kernel {}", handle.name), code);
  }
  if (watch != nullptr) {
    std::vector<std::span<const std::byte>> scalars;
    for (const Argument& a : arguments) scalars.emplace_back(a.value_.data(), a.size_);
    const auto resources = [&] { return resources_of(handle.kernel, impl_->device); };
    watch->launched({handle.name, range, scalars, handle.lane_width, handle.precision, resources});
  }
  const double least = handle.launch_time.least(units);
  const Impl::Pending launched{kernel.handle_, work,  units,  least,
                               most,           event, before, Trace::Clock::now()};
  impl_->patient_wait.expect(least);
  if (impl_->events_have_times.value_or(false)) {
    impl_->pending.push_back(launched);
    if (alone || !handle.launch_time.is_known()) impl_->collect_times();
    return;
  }
  impl_->expect(impl_->wait([&] { return event.wait(); }),
                fmt::format("running kernel {}", handle.name));
  const std::chrono::nanoseconds length = Trace::Clock::now() - before;
  if (!impl_->events_have_times) {
    impl_->events_have_times = event.getProfilingInfo<CL_PROFILING_COMMAND_END>() != 0;
  }
  if (*impl_->events_have_times) {
    impl_->collect_time(launched);
    return;
  }
  impl_->add_time(launched, length);
  if (impl_->trace) {
    impl_->trace->add(handle.name, impl_->row, Trace::Timer::wall, before, length);
  }
}

std::size_t Context::items_per_launch(const Kernel& kernel, double cost) const {
  return static_cast<std::size_t>(std::max(1.0, kernel.handle_->sizer.work() / cost));
}

void Context::Impl::add_time(const Pending& launch, std::chrono::nanoseconds length) {
  const double seconds = 1e-9 * static_cast<double>(length.count());
  auto& time = times[launch.kernel->name];
  ++time.launches;
  time.seconds += seconds;
  if (launch.work > 0) launch.kernel->sizer.learn(launch.work, seconds);
  launch.kernel->launch_time.learn(launch.units, seconds);
}

void Context::Impl::collect_time(const Pending& launch) {
  const auto status = launch.event.getInfo<CL_EVENT_COMMAND_EXECUTION_STATUS>();
  expect(status < 0 ? status : CL_SUCCESS, fmt::format("running kernel {}", launch.kernel->name));
  const DeviceTimes device_times = times_of(launch.event);
  const auto length = device_times.end - device_times.start;
  add_time(launch, length);
  if (!trace) return;
  trace->add(launch.kernel->name, row, Trace::Timer::device,
             clock.on_host(device_times, launch.before, launch.after), length);
}

void Context::Impl::make_room(double seconds) {
  double queued = 0;
  for (const Pending& launch : pending) queued += launch.most;
  const double room = info.draws_screen ? kMostQueuedBesideScreen : kMostQueued;
  const std::size_t keep = pending.size() < kMostPending ? pending.size() : kMostPending / 2;
  std::size_t done = 0;
  for (; done < pending.size() && (queued + seconds > room || pending.size() - done > keep);
       ++done) {
    queued -= pending[done].most;
  }
  if (done > 0) {
    double left = 0;
    for (const Pending& launch : std::span(pending).subspan(done)) left += launch.least;
    const Pending& last = pending[done - 1];
    const cl_int code =
        patient_wait([&] { queue.flush(); }, [&] { return last.event.wait(); }, left);
    const std::string call = fmt::format("running kernel {}", last.kernel->name);
    // A launch that failed says itself why.
    if (code != CL_EXEC_STATUS_ERROR_FOR_EVENTS_IN_WAIT_LIST) expect(code, call);
    collect_times(done);
    expect(code, call);
  }
  waited->add({.most_queued_seconds = queued + seconds});
}

void Context::Impl::collect_times(std::size_t count) {
  for (const Pending& launch : std::span(pending).first(count)) collect_time(launch);
  pending.erase(pending.begin(), pending.begin() + static_cast<std::ptrdiff_t>(count));
}

void Context::Impl::collect_finished() {
  const auto has_run = [](const Pending& launch) {
    return launch.event.getInfo<CL_EVENT_COMMAND_EXECUTION_STATUS>() <= CL_COMPLETE;
  };
  // A driver may be late to tell of what it has done.
  if (!std::ranges::all_of(pending, has_run)) {
    collect_times();
    return;
  }
  collect_times(pending.size());
  copied.clear();
  copied_bytes = 0;
}

void Context::Impl::collect_times() {
  expect(wait([&] { return queue.finish(); }), "clFinish");
  collect_times(pending.size());
  copied.clear();
  copied_bytes = 0;
}

void Context::finish() { impl_->collect_times(); }

std::map<std::string, KernelTime> Context::kernel_times() {
  impl_->collect_times();
  return impl_->times;
}

WaitTime Context::wait_time() const { return impl_->waited->value(); }

void Context::record(std::shared_ptr<Trace> trace, Trace::Row row) {
  impl_->collect_times();
  impl_->trace = std::move(trace);
  impl_->row = row;
}

const std::shared_ptr<Trace>& Context::trace() const { return impl_->trace; }

void Context::reset_kernel_times() {
  impl_->collect_times();
  impl_->times.clear();
}

}  // namespace qjulia::device
