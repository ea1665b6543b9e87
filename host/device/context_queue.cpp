/// A context's queue: launches, waits for them, and what they took.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <functional>

#include "device/context_impl.hpp"
#include "device/kernel_resources.hpp"
#include "device/launch_watch.hpp"

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

/// Estimated work in a queue, in seconds: drivers fail or screens freeze when there is more.
constexpr double kMostQueued = 1, kMostQueuedBesideScreen = 0.2;
/// Launches in a queue, however short.
constexpr std::size_t kMostPending = 1024;

}  // namespace

Argument::Argument(const void* value, std::size_t size) : size_(size) {
  std::memcpy(value_.data(), value, size);
}
Argument::Argument(std::int32_t value) : Argument(&value, sizeof value) {}
Argument Argument::real(double value, Precision precision) {
  return precision == Precision::dbl ? of(value) : of(static_cast<float>(value));
}

void Context::launch(const Kernel& kernel, const Range& range, std::span<const Argument> arguments,
                     const LaunchWork& work, double cost) {
  auto& handle = *kernel.handle_;
  impl_->expect_own_process(fmt::format("launching kernel {}", handle.name));
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

  const double units = cost > 0 ? cost : items_of(range);
  const double most = handle.launch_time.most(units);
  impl_->make_room(most);
  Trace::Call call{.before = Trace::Clock::now(),
                   .slots = work.slots,
                   .bytes = work.reals * static_cast<double>(real_bytes(handle.precision)),
                   .at_most = work.at_most};
  cl::Event event;
  const auto enqueue = [&] {
    auto& g = call.global = range.global;
    auto& l = call.local = range.local;
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
    const auto resources = [&] { return resources_of(handle.kernel, impl_->device); };
    watch->launched({handle.name, work, handle.precision, resources});
  }
  const double least = handle.launch_time.least(units);
  call.after = Trace::Clock::now();
  const Impl::Pending launched{kernel.handle_, cost, units, least, most, event, call};
  impl_->patient_wait.expect(least);
  if (impl_->events_have_times.value_or(false)) {
    impl_->pending.push_back(launched);
    if (alone || !handle.launch_time.is_known()) impl_->collect_times();
    return;
  }
  impl_->expect(impl_->wait([&] { return event.wait(); }),
                fmt::format("running kernel {}", handle.name));
  const std::chrono::nanoseconds length = Trace::Clock::now() - call.before;
  if (!impl_->events_have_times) {
    impl_->events_have_times = event.getProfilingInfo<CL_PROFILING_COMMAND_END>() != 0;
  }
  if (*impl_->events_have_times) {
    impl_->collect_time(launched);
    return;
  }
  impl_->add_time(launched, length);
  if (impl_->trace) {
    impl_->trace->add_launch(handle.name, impl_->row, Trace::Timer::wall, call.before, length,
                             call);
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
  if (launch.cost > 0) launch.kernel->sizer.learn(launch.cost, seconds);
  launch.kernel->launch_time.learn(launch.units, seconds);
}

void Context::Impl::collect_time(const Pending& launch) {
  const auto status = launch.event.getInfo<CL_EVENT_COMMAND_EXECUTION_STATUS>();
  expect(status < 0 ? status : CL_SUCCESS, fmt::format("running kernel {}", launch.kernel->name));
  const DeviceTimes device_times = times_of(launch.event);
  const auto length = device_times.end - device_times.start;
  add_time(launch, length);
  if (!trace) return;
  const auto start = clock.on_host(device_times, launch.call.before, launch.call.after);
  trace->add_launch(launch.kernel->name, row, Trace::Timer::device, start, length, launch.call);
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
  // A launch that failed stays. What the buffers hold after it is unknown, so no later wait of this
  // context may succeed.
  std::size_t collected = 0;
  const auto erase_collected = [&] {
    pending.erase(pending.begin(), pending.begin() + static_cast<std::ptrdiff_t>(collected));
  };
  try {
    for (; collected < count; ++collected) collect_time(pending[collected]);
  } catch (...) {
    erase_collected();
    throw;
  }
  erase_collected();
}

void Context::Impl::collect_finished() {
  const auto has_run = [](const Pending& launch) {
    return launch.event.getInfo<CL_EVENT_COMMAND_EXECUTION_STATUS>() <= CL_COMPLETE;
  };
  // A driver may report late that a launch has ended.
  if (!std::ranges::all_of(pending, has_run)) {
    collect_times();
    return;
  }
  collect_times(pending.size());
  copied.clear();
  copied_bytes = 0;
}

void Context::Impl::collect_times() {
  expect_own_process("waiting");
  expect(wait([&] { return queue.finish(); }), "clFinish");
  collect_times(pending.size());
  copied.clear();
  copied_bytes = 0;
}

void Context::finish() { impl_->collect_times(); }

}  // namespace qjulia::device
