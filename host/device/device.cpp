#include "qjulia/device/device.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>

#include "base/surroundings.hpp"
#include "base/text.hpp"
#include "device/context.hpp"
#include "device/opencl.hpp"
#include "device/quirks.hpp"
#include "device/ranking.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia {
namespace {

bool matches(const DeviceInfo& info, const std::string& wanted) {
  if (wanted == "gpu") return info.kind == DeviceKind::gpu;
  if (wanted == "cpu") return info.kind == DeviceKind::cpu;
  if (const auto numbers = base::split(wanted, ':'); numbers.size() == 2) {
    const auto platform = base::number_in<int>(numbers[0]);
    const auto index = base::number_in<int>(numbers[1]);
    if (platform && index) return info.platform == *platform && info.index == *index;
  }
  return base::lower_case(info.name).find(wanted) != std::string::npos;
}

/// What the choice says, else the environment; empty where neither says anything.
std::string chosen_or(const std::string& choice, const char* variable) {
  if (!choice.empty()) return choice;
  const char* value = std::getenv(variable);
  return value == nullptr ? "" : value;
}

/// None where the device decides.
std::optional<Layout> wanted_layout(const DeviceChoice& choice) {
  const std::string name = base::lower_case(chosen_or(choice.layout, "QJULIA_LAYOUT"));
  if (name.empty() || name == "auto") return std::nullopt;
  if (name == "cpu") return Layout::cpu;
  if (name == "gpu") return Layout::gpu;
  throw InputError(fmt::format("{} is '{}'; give cpu, gpu or auto",
                               choice.layout.empty() ? "QJULIA_LAYOUT" : "the layout", name));
}

constexpr const char* kInstallHint =
    "install an OpenCL driver: 'apt-get install pocl-opencl-icd' runs on any CPU; a GPU needs its "
    "vendor's OpenCL package";

/// What fits the surroundings, else what always does.
/// @param is_any_shown whether drivers show other devices
std::string what_to_do(bool is_any_shown) {
  std::vector<base::Finding> findings = base::surroundings();
  // If an installed driver cannot be used, that is why no device is shown at all.
  const auto is_cause = [](const base::Finding& finding) {
    return finding.kind == "library" || finding.kind == "cache";
  };
  if (!is_any_shown && std::ranges::any_of(findings, is_cause)) {
    std::erase_if(findings, std::not_fn(is_cause));
  }
  std::string text;
  for (const base::Finding& finding : findings) text += "\n  " + finding.text;
  return text.empty() ? kInstallHint : "findings about this machine:" + text;
}

DeviceInfo find_device(const std::string& wanted) {
  const device::Inventory all = device::take_inventory();
  if (all.devices.empty()) {
    throw NoDeviceError(fmt::format("no OpenCL device was found ({}); {}",
                                    fmt::join(all.problems, "; "), what_to_do(false)));
  }
  std::vector<DeviceInfo> matching = all.devices;
  std::erase_if(matching, [&](const DeviceInfo& d) {
    return !wanted.empty() && !matches(d, base::lower_case(wanted));
  });
  if (!matching.empty()) return *std::ranges::min_element(matching, {}, &DeviceInfo::rank);
  std::string names;
  for (const auto& d : all.devices) {
    names += fmt::format("\n  {}  {}  {}", device::device_id(d), to_string(d.kind), d.name);
  }
  for (const std::string& problem : all.problems) names += "\n  " + problem;
  throw NoDeviceError(
      fmt::format("no device matches '{}'; there are:{}\n({})", wanted, names, what_to_do(true)));
}

}  // namespace

const char* to_string(Precision precision) {
  return precision == Precision::dbl ? "double" : "single";
}

std::string to_string(DeviceKind kind) {
  switch (kind) {
    case DeviceKind::cpu:
      return "cpu";
    case DeviceKind::gpu:
      return "gpu";
    case DeviceKind::accelerator:
      return "accelerator";
    case DeviceKind::other:
      break;
  }
  return "other";
}

std::string to_string(Layout layout) {
  switch (layout) {
    case Layout::cpu:
      return "cpu";
    case Layout::gpu:
      return "gpu";
  }
  return {};
}

std::string known_fault(const DeviceInfo& info) {
  if (!device::cuts_long_loops(info)) return {};
  return fmt::format(
      "'{}' ends the loops of a work-item after 65,535 turns without an error: results for maps of "
      "hundreds of factors can be wrong; use another device, such as PoCL's",
      info.name);
}

nlohmann::json to_json(const DeviceInfo& d) {
  const auto text_or_null = [](const std::string& text) {
    return text.empty() ? nlohmann::json() : nlohmann::json(text);
  };
  return {{"id", device::device_id(d)},
          {"kind", to_string(d.kind)},
          {"name", d.name},
          {"vendor", d.vendor},
          {"platform", d.platform_name},
          {"driver", d.driver_version},
          {"opencl", d.opencl_version},
          {"compute_units", d.compute_units},
          {"clock_mhz", d.clock_mhz},
          {"native_float_lanes", d.native_float_lanes},
          {"global_memory", d.global_memory},
          {"largest_allocation", d.largest_allocation},
          {"local_memory", d.local_memory},
          {"largest_work_group", d.largest_work_group},
          {"double_precision", d.has_double},
          {"shares_memory", d.shares_memory},
          {"draws_screen", d.draws_screen},
          {"pci_address", text_or_null(d.pci_address)},
          {"uuid", text_or_null(d.uuid)},
          {"estimated_speed", d.estimated_speed},
          {"rank", d.rank},
          {"same_as", text_or_null(d.same_as)},
          {"layout", to_string(device::suited_layout(d))}};
}

std::vector<DeviceInfo> list_devices() { return device::take_inventory().devices; }

Device Device::choose(const DeviceChoice& choice) {
  const auto layout = wanted_layout(choice);
  const Device device(
      std::make_shared<device::Context>(find_device(chosen_or(choice.name, "QJULIA_DEVICE"))));
  return layout ? device.with_layout(*layout) : device;
}

const DeviceInfo& Device::info() const { return context_->info(); }

void Device::expect_own_process() const { context_->expect_own_process(); }

Device::Device(std::shared_ptr<device::Context> context)
    : context_(std::move(context)), layout_(device::suited_layout(info())) {
  *this = with_layout(layout_);
}

Device Device::with_layout(Layout layout) const {
  Device copy = *this;
  copy.layout_ = layout;
  for (const Precision p : kPrecisions) {
    copy.tuning_[static_cast<std::size_t>(p)] = device::default_tuning(info(), p, layout);
  }
  return copy;
}

Device Device::with_lane_width(int width) const {
  Device copy = *this;
  for (const Precision p : kPrecisions) {
    copy = copy.with_tuning(p, device::default_tuning(info(), p, layout_, width));
  }
  return copy;
}

Device Device::with_tuning(Precision precision, const Tuning& tuning) const {
  tuning.validate();
  Device copy = *this;
  copy.tuning_[static_cast<std::size_t>(precision)] = tuning;
  return copy;
}

bool Device::has_own_layout() const { return layout_ == device::suited_layout(info()); }

bool Device::is_tuned(Precision precision) const {
  return tuning(precision) != device::default_tuning(info(), precision, layout_);
}

Device Device::sibling(Trace::Row row) const {
  Device other(std::make_shared<device::Context>(info(), context_.get()));
  other.layout_ = layout_;
  other.tuning_ = tuning_;
  other.context_->record(context_->trace(), row);
  return other;
}

std::map<std::string, KernelTime> Device::kernel_times() const { return context_->kernel_times(); }

void Device::reset_kernel_times() const { context_->reset_kernel_times(); }

WaitTime Device::wait_time() const { return context_->wait_time(); }

void Device::record(std::shared_ptr<Trace> trace) const { context_->record(std::move(trace)); }

}  // namespace qjulia
