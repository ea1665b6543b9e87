#include "device/opencl.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <optional>

#include "base/surroundings.hpp"
#include "device/context.hpp"
#include "device/error_names.hpp"
#include "device/ranking.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia::device {
namespace {

/// An error code of our own; OpenCL's are negative.
constexpr int kForkedProcess = 1;

/// Not CL_OUT_OF_RESOURCES: that is said of launches too, whatever they lack.
bool means_out_of_memory(int code) {
  return code == CL_MEM_OBJECT_ALLOCATION_FAILURE || code == CL_INVALID_BUFFER_SIZE ||
         code == CL_OUT_OF_HOST_MEMORY;
}

/// What to do about an error; empty where nothing is known.
const char* advice(int code) {
  if (means_out_of_memory(code)) {
    return "; the device has too little memory: fewer factors, samples or points need less, or "
           "choose another device";
  }
  if (code == CL_OUT_OF_RESOURCES) {
    return "; the device has too few registers or too little memory for this launch, or its driver "
           "gave up on it: fewer factors, samples or points need less; 'qjulia doctor' says what "
           "works there";
  }
  if (code == kForkedProcess) {
    return ": this process was forked from the one that opened it, and drivers do not work in "
           "forked processes; open devices in the child processes alone, or start these as new "
           "programs (in Python, with multiprocessing's start method \"spawn\")";
  }
  if (means_lost_device(code)) {
    return "; the driver has lost the device, as after a crash, a launch that a watchdog ended or "
           "a suspended machine: start the program again; 'qjulia doctor' checks whether the "
           "device still works";
  }
  return "";
}

/// What a device says to a question of some bytes; none where it does not know the question.
template <class Answer>
std::optional<Answer> answer(const cl::Device& device, cl_device_info question) {
  Answer given{};
  if (::clGetDeviceInfo(device(), question, sizeof given, &given, nullptr) != CL_SUCCESS) return {};
  return given;
}

/// Empty for the place of the bus's own bridge, which drivers say that do not know theirs.
std::string pci_text(unsigned domain, unsigned bus, unsigned slot, unsigned function) {
  if (bus == 0 && slot == 0 && function == 0) return {};
  return fmt::format("{:04x}:{:02x}:{:02x}.{:x}", domain, bus, slot, function);
}

bool has_extension(const std::string& extensions, const char* name) {
  return extensions.find(name) != std::string::npos;
}

/// A GPU's place on the bus, by whichever extension it has; empty where it has none.
std::string pci_address(const cl::Device& device, const std::string& extensions) {
  constexpr cl_device_info kBusInfo = 0x410F;       // CL_DEVICE_PCI_BUS_INFO_KHR
  constexpr cl_device_info kNvidiaBus = 0x4008;     // CL_DEVICE_PCI_BUS_ID_NV
  constexpr cl_device_info kNvidiaSlot = 0x4009;    // CL_DEVICE_PCI_SLOT_ID_NV: slot and function
  constexpr cl_device_info kNvidiaDomain = 0x400A;  // CL_DEVICE_PCI_DOMAIN_ID_NV
  constexpr cl_device_info kAmdTopology = 0x4037;   // CL_DEVICE_TOPOLOGY_AMD
  if (has_extension(extensions, "cl_khr_pci_bus_info")) {
    if (const auto at = answer<std::array<cl_uint, 4>>(device, kBusInfo)) {
      return pci_text((*at)[0], (*at)[1], (*at)[2], (*at)[3]);
    }
  }
  if (has_extension(extensions, "cl_nv_device_attribute_query")) {
    const auto bus = answer<cl_uint>(device, kNvidiaBus);
    const auto slot = answer<cl_uint>(device, kNvidiaSlot);
    if (bus && slot) {
      return pci_text(answer<cl_uint>(device, kNvidiaDomain).value_or(0), *bus, *slot >> 3U,
                      *slot & 7U);
    }
  }
  if (has_extension(extensions, "cl_amd_device_attribute_query")) {
    // cl_device_topology_amd: a type, 1 for PCI Express, 17 unused bytes, bus, device, function.
    const auto at = answer<std::array<unsigned char, 24>>(device, kAmdTopology);
    if (at && (*at)[0] == 1) return pci_text(0, (*at)[21], (*at)[22], (*at)[23]);
  }
  return {};
}

/// A GPU's UUID; empty where it has none.
std::string uuid(const cl::Device& device, const std::string& extensions) {
  constexpr cl_device_info kUuid = 0x106A;  // CL_DEVICE_UUID_KHR
  if (!has_extension(extensions, "cl_khr_device_uuid")) return {};
  const auto bytes = answer<std::array<unsigned char, 16>>(device, kUuid);
  if (!bytes || std::ranges::all_of(*bytes, [](unsigned char b) { return b == 0; })) return {};
  return fmt::format("{:02x}", fmt::join(*bytes, ""));
}

}  // namespace

void expect_own_process(pid_t opened_by, const std::string& device, const std::string& call) {
  if (::getpid() != opened_by) throw DeviceError(device, call, kForkedProcess);
}

std::vector<cl::Platform> platforms(cl_int* code) {
  static const pid_t first_user = ::getpid();
  expect_own_process(first_user, "OpenCL", "listing devices");
  std::vector<cl::Platform> found;
  const cl_int told = cl::Platform::get(&found);
  if (code != nullptr) *code = told;
  if (told != CL_SUCCESS) return {};
  return found;
}

std::vector<cl::Device> devices(const cl::Platform& platform, cl_int* code) {
  // The C++ binding does not report the code of a platform without devices.
  cl_uint count = 0;
  cl_int told = ::clGetDeviceIDs(platform(), CL_DEVICE_TYPE_ALL, 0, nullptr, &count);
  std::vector<cl::Device> found;
  if (told == CL_SUCCESS) told = platform.getDevices(CL_DEVICE_TYPE_ALL, &found);
  if (code != nullptr) *code = told;
  if (told != CL_SUCCESS) return {};
  std::erase_if(found, [](const cl::Device& d) { return !d.getInfo<CL_DEVICE_AVAILABLE>(); });
  return found;
}

Inventory take_inventory() {
  Inventory all;
  cl_int code = CL_SUCCESS;
  const auto found = platforms(&code);
  if (code != CL_SUCCESS) all.problems.push_back("clGetPlatformIDs: " + named_error(code));
  for (std::size_t p = 0; p < found.size(); ++p) {
    const auto its = devices(found[p], &code);
    if (code != CL_SUCCESS || its.empty()) {
      all.problems.push_back(
          fmt::format("platform '{}' shows no device: {}", found[p].getInfo<CL_PLATFORM_NAME>(),
                      code == CL_SUCCESS ? "none of its devices is available" : named_error(code)));
    }
    for (std::size_t d = 0; d < its.size(); ++d) {
      all.devices.push_back(describe(its[d], static_cast<int>(p), static_cast<int>(d)));
    }
  }
  mark_same_hardware(all.devices);
  rank_devices(all.devices);
  return all;
}

DeviceInfo describe(const cl::Device& device, int platform_index, int device_index) {
  const auto type = device.getInfo<CL_DEVICE_TYPE>();
  const cl::Platform platform(device.getInfo<CL_DEVICE_PLATFORM>());
  DeviceInfo info{.platform = platform_index,
                  .index = device_index,
                  .kind = (type & CL_DEVICE_TYPE_GPU) != 0           ? DeviceKind::gpu
                          : (type & CL_DEVICE_TYPE_CPU) != 0         ? DeviceKind::cpu
                          : (type & CL_DEVICE_TYPE_ACCELERATOR) != 0 ? DeviceKind::accelerator
                                                                     : DeviceKind::other,
                  .name = device.getInfo<CL_DEVICE_NAME>(),
                  .vendor = device.getInfo<CL_DEVICE_VENDOR>(),
                  .platform_name = platform.getInfo<CL_PLATFORM_NAME>(),
                  .driver_version = device.getInfo<CL_DRIVER_VERSION>(),
                  .opencl_version = device.getInfo<CL_DEVICE_VERSION>(),
                  .compute_units = device.getInfo<CL_DEVICE_MAX_COMPUTE_UNITS>(),
                  .clock_mhz = device.getInfo<CL_DEVICE_MAX_CLOCK_FREQUENCY>(),
                  .global_memory = device.getInfo<CL_DEVICE_GLOBAL_MEM_SIZE>(),
                  .largest_allocation = device.getInfo<CL_DEVICE_MAX_MEM_ALLOC_SIZE>(),
                  .local_memory = device.getInfo<CL_DEVICE_LOCAL_MEM_SIZE>(),
                  .largest_work_group = device.getInfo<CL_DEVICE_MAX_WORK_GROUP_SIZE>(),
                  .has_double = device.getInfo<CL_DEVICE_DOUBLE_FP_CONFIG>() != 0,
                  .shares_memory = device.getInfo<CL_DEVICE_HOST_UNIFIED_MEMORY>() != 0};
  info.native_float_lanes =
      float_lanes(info.kind, device.getInfo<CL_DEVICE_NATIVE_VECTOR_WIDTH_FLOAT>());
  if (info.kind == DeviceKind::gpu) {
    const auto extensions = device.getInfo<CL_DEVICE_EXTENSIONS>();
    info.pci_address = pci_address(device, extensions);
    info.uuid = uuid(device, extensions);
    info.draws_screen = base::draws_screen(info.pci_address);
  }
  info.estimated_speed = estimated_speed(info);
  return info;
}

bool means_refused_group(int code) {
  return code == CL_INVALID_WORK_GROUP_SIZE || code == CL_INVALID_WORK_ITEM_SIZE;
}

bool is_out_of_memory(const DeviceError& error) { return means_out_of_memory(error.code()); }

bool is_out_of_resources(const DeviceError& error) {
  return is_out_of_memory(error) || error.code() == CL_OUT_OF_RESOURCES;
}

bool is_refused_group(const DeviceError& error) { return means_refused_group(error.code()); }

}  // namespace qjulia::device

bool qjulia::DeviceError::is_lost() const noexcept { return device::means_lost_device(code_); }

qjulia::DeviceError::DeviceError(const std::string& device, const std::string& call, int error_code)
    : Error(fmt::format(
          "{} failed on '{}'{}{}", call, device,
          error_code == device::kForkedProcess ? "" : ": " + device::named_error(error_code),
          device::advice(error_code))),
      code_(error_code) {}
