#pragma once
/// OpenCL devices: what there is, and which one to use. No OpenCL type appears here.

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "qjulia/base/trace.hpp"
#include "qjulia/device/tuning.hpp"

namespace qjulia {

namespace device {
class Context;
}

enum class Precision { single, dbl };
inline constexpr std::array kPrecisions{Precision::single, Precision::dbl};

/// "single" or "double".
const char* to_string(Precision precision);

enum class DeviceKind { cpu, gpu, accelerator, other };

/// How kernels are cut into work-items.
enum class Layout {
  cpu,  ///< wide lanes in each of few work-items, which sum privately
  gpu,  ///< one lane in each of many work-items; groups of them sum and share tiles in local memory
};

/// What OpenCL says of one device, as numbers of the whole device.
struct DeviceInfo {
  int platform = 0;  ///< index of its platform in the loader's order
  int index = 0;     ///< index within its platform
  DeviceKind kind = DeviceKind::other;
  std::string name;
  std::string vendor;
  std::string platform_name;
  std::string driver_version;
  std::string opencl_version;
  unsigned compute_units = 0;
  unsigned clock_mhz = 0;
  unsigned native_float_lanes = 1;       ///< floats in one native vector register
  std::uint64_t global_memory = 0;       ///< bytes
  std::uint64_t largest_allocation = 0;  ///< bytes
  std::uint64_t local_memory = 0;        ///< bytes of one work-group
  std::size_t largest_work_group = 0;    ///< work-items
  bool has_double = false;               ///< cl_khr_fp64
  bool shares_memory = false;            ///< with the host, as integrated GPUs do
  bool draws_screen = false;             ///< a GPU to which a monitor is connected
  std::string pci_address{};             ///< of a GPU, "0000:01:00.0"; empty if not reported
  std::string uuid{};                    ///< of a GPU, 32 hexadecimal digits; empty if not reported
  /// Peak rate in billions of multiply-adds per second: compute units times clock times the lanes
  /// of a compute unit. Drivers do not report lanes, so this is an estimate by vendor.
  double estimated_speed = 0;
  int rank = 0;           ///< among all devices; rank 1 is the default device
  std::string same_as{};  ///< "P:D" of the same GPU under a better platform; empty: none
};

std::string to_string(DeviceKind kind);
std::string to_string(Layout layout);

/// All of it, with the layout that suits the device and "P:D" as its "id".
nlohmann::json to_json(const DeviceInfo& info);

/// What is known to go wrong on the device without an error, as a sentence; empty where nothing is.
std::string known_fault(const DeviceInfo& info);

/// Every usable device of every platform, in the loader's order, with its rank: GPUs with memory of
/// their own, GPUs that share the host's, other accelerators, CPUs; the fastest of a kind first. A
/// GPU that two platforms show is recognised by its PCI address or UUID: one of the two entries has
/// `same_as`, and ranks behind the others of its kind. An empty or broken platform is skipped.
std::vector<DeviceInfo> list_devices();

/// How often a kernel ran and how long it took on the device.
struct KernelTime {
  std::uint64_t launches = 0;
  double seconds = 0;
};

/// How long threads have waited for a device. If a driver keeps a core busy while it waits, the
/// library sleeps for most of the time that launches are known to take before it calls the driver.
struct WaitTime {
  double seconds = 0;            ///< wall time, including sleep
  double processor_seconds = 0;  ///< processor time of the waiting threads
  double slept_seconds = 0;
  std::uint64_t waits = 0;
  std::uint64_t transfers = 0;     ///< copies from the host to the device or back
  double most_queued_seconds = 0;  ///< estimated work of one queue at a time, at most
};

/// A device and a layout, as a user asks for them.
struct DeviceChoice {
  /// `gpu`, `cpu`, `P:D` (platform and device number as `list_devices` gives them) or part of a
  /// name, in any case; of several that match, the one that ranks first. Empty: the environment's
  /// QJULIA_DEVICE, else the device that ranks first.
  std::string name{};
  /// `cpu`, `gpu` or `auto`, the one that suits the device. Empty: the environment's QJULIA_LAYOUT,
  /// else `auto`.
  std::string layout{};
};

/// One device, ready to run kernels; copies share it.
class Device {
 public:
  /// @throws NoDeviceError when no device matches: there is never a silent fallback.
  /// @throws InputError when the layout, or that of QJULIA_LAYOUT, is none of those above.
  static Device choose(const DeviceChoice& choice = {});

  const DeviceInfo& info() const;

  /// Drivers do not work in a process that was forked from the one in which the device was opened.
  /// There, every function that uses the device throws this error. Call this function before you
  /// wait for a lock of your own.
  /// @throws DeviceError
  void expect_own_process() const;

  /// The same device with the defaults of this layout, whatever its kind. Results differ in
  /// rounding only; a layout that does not suit the device is slow.
  Device with_layout(Layout layout) const;
  Layout layout() const { return layout_; }
  /// Whether that is the layout that suits the device.
  bool has_own_layout() const;

  /// The same device with kernels compiled for `width` lanes (1, 8 or 16) in place of its own
  /// width, and its layout's defaults for that width. Fewer lanes than the default run slower;
  /// results differ in rounding only.
  Device with_lane_width(int width) const;

  /// The same device with these settings at this precision. @throws InputError
  Device with_tuning(Precision precision, const Tuning& tuning) const;

  /// The same device and settings with a queue and programs of its own, for another thread to use
  /// at the same time. Its launches are recorded as this one's are, on the given row of the trace.
  Device sibling(Trace::Row row = Trace::Row::second_queue) const;

  const Tuning& tuning(Precision precision) const {
    return tuning_[static_cast<std::size_t>(precision)];
  }
  /// Whether the settings differ from the defaults of its layout.
  bool is_tuned(Precision precision) const;

  /// Lanes one work-item computes side by side at this precision.
  int lane_width(Precision precision) const { return tuning(precision).lane_width; }

  /// Kernels of this device and of its copies are recorded from now on; an empty pointer ends
  /// that, and waits for what is under way.
  void record(std::shared_ptr<Trace> trace) const;

  /// Device time by kernel since the last reset; waits for the queue. Where the device's events
  /// carry no times, launches are waited for one by one and timed by the wall clock.
  std::map<std::string, KernelTime> kernel_times() const;
  void reset_kernel_times() const;

  /// How long this device, its copies and siblings have been waited for.
  WaitTime wait_time() const;

  /// Internal: launches, buffers, programs. `qjulia/map/opencl.hpp` has what programs may use of
  /// them.
  explicit Device(std::shared_ptr<device::Context> context);
  device::Context& context() const { return *context_; }

 private:
  std::shared_ptr<device::Context> context_;
  Layout layout_;
  std::array<Tuning, 2> tuning_;  ///< by precision
};

}  // namespace qjulia
