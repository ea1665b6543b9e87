#pragma once
/// The library's own view of a device: buffers, kernels and the one function that launches them.
/// This room holds all the OpenCL code there is; no OpenCL type leaves it.

#include <array>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "device/launch_work.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/base/trace.hpp"
#include "qjulia/device/device.hpp"

namespace qjulia::device {

class Context;
struct Handles;

/// An allocation on the device. Empty until allocated; copies share it.
class Memory {
 public:
  std::size_t bytes() const { return bytes_; }

 protected:
  struct Handle;
  friend class Context;
  friend struct Handles;
  std::shared_ptr<Handle> handle_;
  std::size_t bytes_ = 0;
};

/// `size()` elements of a fixed-layout type on the device.
template <class T>
class Buffer : public Memory {
 public:
  Buffer() = default;
  std::size_t size() const { return bytes_ / sizeof(T); }

 private:
  friend class Context;
  explicit Buffer(const Memory& memory) : Memory(memory) {}
};

/// Bytes of a real.
constexpr std::size_t real_bytes(Precision precision) {
  return precision == Precision::dbl ? sizeof(double) : sizeof(float);
}

/// Reals of the precision chosen at run time; the host side always speaks double.
class RealBuffer : public Memory {
 public:
  RealBuffer() = default;
  Precision precision() const { return precision_; }
  std::size_t size() const { return bytes_ / real_bytes(precision_); }

 private:
  friend class Context;
  RealBuffer(const Memory& memory, Precision precision) : Memory(memory), precision_(precision) {}
  Precision precision_ = Precision::single;
};

/// What a kernel is compiled for. Everything here enters the program cache's key.
struct BuildOptions {
  int lane_width = 1;                       ///< QJ_WIDTH
  Precision precision = Precision::single;  ///< QJ_DOUBLE
  std::map<std::string, int> defines;       ///< further -D names, sorted
  /// The files that `#include NAME` in the source stands for, by NAME.
  std::map<std::string, std::string> files{};
};

/// A compiled kernel. It keeps the program it came from alive.
class Kernel {
  struct Handle;
  friend class Context;
  std::shared_ptr<Handle> handle_;
};

/// A count as kernels take it.
inline std::int32_t narrow(std::size_t count) { return static_cast<std::int32_t>(count); }

/// One kernel argument: a buffer, a scalar, or a struct of scalars.
class Argument {
 public:
  /// A struct of layout/arguments.h, or another that host and device lay out alike.
  template <class Struct>
  static Argument of(const Struct& arguments) {
    static_assert(std::is_trivially_copyable_v<Struct> && sizeof arguments <= kLargest);
    return {&arguments, sizeof arguments};
  }
  Argument(const Memory& memory) : memory_(&memory) {}  // NOLINT(google-explicit-constructor)
  Argument(std::int32_t value);                         // NOLINT(google-explicit-constructor)
  /// A real of the kernel's precision.
  static Argument real(double value, Precision precision);

 private:
  friend class Context;
  static constexpr std::size_t kLargest = 128;
  Argument(const void* value, std::size_t size);
  const Memory* memory_ = nullptr;
  std::array<std::byte, kLargest> value_{};
  std::size_t size_ = 0;
};

/// A launch's struct of scalars: `make` gives it, with the kernel's precision as the type of what
/// it is called with: `[&](auto r) { using real = decltype(r); return qj_x<real>{.a = real(a)}; }`.
template <class Make>
Argument arguments(Precision precision, const Make& make) {
  return precision == Precision::dbl ? Argument::of(make(double{})) : Argument::of(make(float{}));
}

/// The work-items of a launch, in one to three dimensions. `local` of zeros takes groups as large
/// as suits the device and the kernel along the first dimension, and pads that dimension to a
/// multiple of them: kernels return at once in work-items past their count. Otherwise `local` must
/// divide `global`, and a device that refuses such groups is an error (is_refused_group).
struct Range {
  std::array<std::size_t, 3> global{1, 1, 1};
  std::array<std::size_t, 3> local{0, 0, 0};
};

/// Whether a device's error says that a buffer was too large for it: callers then ask for less.
bool is_out_of_memory(const DeviceError& error);
/// The same, or that a launch was too large.
bool is_out_of_resources(const DeviceError& error);
/// Whether it says that a work-group was too large.
bool is_refused_group(const DeviceError& error);

/// A launch that was refused when it was to be queued, so that nothing of it has run.
class RefusedLaunch : public DeviceError {
 public:
  using DeviceError::DeviceError;
};

/// A transfer of reals from the beginning of a buffer.
struct RealRead {
  const RealBuffer& from;
  std::span<double> to;
};

/// An OpenCL context with one in-order queue and a cache of built programs. Not for use by several
/// threads at a time.
///
/// A launch can fail after the device has accepted it. What the buffers hold is then unknown, and
/// the context is of no more use: the call that collects the launch throws a DeviceError, and so
/// does every later call that waits for the queue. That is on purpose. A caller that asks for less
/// memory after an error waits for the queue first, so it cannot take the failure of an earlier
/// launch for its own and go on with wrong numbers. There is one exception: the context's first
/// launch, and every launch on a device whose events carry no times, is waited for in `launch`; if
/// it fails, only that call throws.
class Context {
 public:
  /// @param sharing a context of the same device whose buffers this one can use as well, once what
  ///   writes them has finished.
  explicit Context(const DeviceInfo& info, const Context* sharing = nullptr);
  /// One that works with a program's own objects and queue, which it retains.
  Context(const DeviceInfo& info, const Handles& handles);
  ~Context();
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  const DeviceInfo& info() const;

  /// What `Device::expect_own_process` does. All functions that use the queue or the driver call it
  /// themselves.
  void expect_own_process() const;

  /// @throws DeviceError when the device has not that much memory, or takes no buffer that large:
  /// what it reports of both is looked at before it is asked, since drivers may find out late.
  template <class T>
  Buffer<T> allocate(std::size_t count) {
    return Buffer<T>(allocate_bytes(count * sizeof(T)));
  }
  RealBuffer allocate_real(std::size_t count, Precision precision);

  /// Bytes of all buffers that were alive at once, at most, since the last reset.
  std::size_t peak_allocated_bytes() const;
  void reset_peak_allocated_bytes();

  /// Allocates and fills.
  template <class T>
  Buffer<T> upload(std::span<const T> values) {
    Buffer<T> buffer = allocate<T>(values.size());
    write(buffer, values);
    return buffer;
  }
  RealBuffer upload_real(std::span<const double> values, Precision precision);
  RealBuffer upload_real(std::span<const float> values);

  /// Copies to the buffer's beginning. The values may be changed as soon as this returns.
  template <class T>
  void write(const Buffer<T>& buffer, std::span<const T> values) {
    write_bytes(buffer, std::as_bytes(values));
  }
  void write(const RealBuffer& buffer, std::span<const double> values);

  /// Copies `out.size()` elements from the buffer's beginning, after all launches before it.
  /// @throws DeviceError when the copy fails, or a launch that was queued before (see the class)
  template <class T>
  void read(const Buffer<T>& buffer, std::span<T> out) {
    read_bytes(buffer, std::as_writable_bytes(out));
  }
  void read(const RealBuffer& buffer, std::span<double> out);
  /// All of them in one wait.
  void read(std::span<const RealRead> reads);

  /// The kernel `name` of the embedded file `file`, built at first use and kept.
  /// @throws KernelBuildError with the compiler's log.
  Kernel kernel(const std::string& file, const std::string& name, const BuildOptions& options);

  /// Work-items of the largest group the device takes for this kernel; 0 where its local memory
  /// does not suffice.
  std::size_t largest_group(const Kernel& kernel) const;

  /// Puts a kernel in the queue. Checks the number and kind of arguments and the range first.
  /// Waits first until the queue has room: it holds estimated work of at most a second, on a GPU
  /// that draws a screen of 0.2 s. A kernel's first launch is waited for, and so timed.
  /// @param work what it has to do, for whoever watches launches.
  /// @param cost of all its work-items, in a unit of the kernel's own; 0: not said.
  /// @throws RefusedLaunch, with the kernel's name, when the device refuses: nothing of it has run,
  /// and the context goes on. DeviceError when a launch that the device had accepted, this one or
  /// an earlier one, is waited for and has failed (see the class).
  void launch(const Kernel& kernel, const Range& range, std::span<const Argument> arguments,
              const LaunchWork& work, double cost = 0);
  void launch(const Kernel& kernel, const Range& range, std::initializer_list<Argument> arguments,
              const LaunchWork& work, double cost = 0) {
    launch(kernel, range, std::span(arguments.begin(), arguments.size()), work, cost);
  }

  /// So many work-items of `cost` each make a launch that takes about 80 ms; at least one. What the
  /// device does in that time is learned from the launches whose cost was said.
  std::size_t items_per_launch(const Kernel& kernel, double cost) const;

  /// Waits until everything queued has run. @throws DeviceError at each call once a queued launch
  /// has failed (see the class).
  void finish();

  /// What `Device::kernel_times` returns.
  std::map<std::string, KernelTime> kernel_times();
  void reset_kernel_times();
  /// What `Device::wait_time` returns.
  WaitTime wait_time() const;

  /// Launches, on `row`, and builds are added to `trace` from now on; empty: no longer.
  void record(std::shared_ptr<Trace> trace, Trace::Row row = Trace::Row::device);
  const std::shared_ptr<Trace>& trace() const;

 private:
  struct Impl;
  friend struct Handles;
  Memory allocate_bytes(std::size_t bytes);
  void write_bytes(const Memory& memory, std::span<const std::byte> bytes);
  struct ByteRead {
    const Memory& from;
    std::span<std::byte> to;
  };
  void read_bytes(const Memory& memory, std::span<std::byte> bytes);
  void read_bytes(std::span<const ByteRead> reads);
  std::unique_ptr<Impl> impl_;
};

}  // namespace qjulia::device
