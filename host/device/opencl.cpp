#include "device/opencl.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "device/context.hpp"
#include "qjulia/error.hpp"

namespace qjulia::device {
namespace {

/// OpenCL's name of an error code, such as CL_OUT_OF_RESOURCES.
const char* error_name(int code) {
#define QJ_NAMED(code) \
  std::pair { code, #code }
  constexpr std::array kNames{QJ_NAMED(CL_DEVICE_NOT_AVAILABLE),
                              QJ_NAMED(CL_COMPILER_NOT_AVAILABLE),
                              QJ_NAMED(CL_MEM_OBJECT_ALLOCATION_FAILURE),
                              QJ_NAMED(CL_OUT_OF_RESOURCES),
                              QJ_NAMED(CL_OUT_OF_HOST_MEMORY),
                              QJ_NAMED(CL_BUILD_PROGRAM_FAILURE),
                              QJ_NAMED(CL_INVALID_VALUE),
                              QJ_NAMED(CL_INVALID_MEM_OBJECT),
                              QJ_NAMED(CL_INVALID_BUFFER_SIZE),
                              QJ_NAMED(CL_INVALID_BUILD_OPTIONS),
                              QJ_NAMED(CL_INVALID_KERNEL_NAME),
                              QJ_NAMED(CL_INVALID_KERNEL_ARGS),
                              QJ_NAMED(CL_INVALID_ARG_INDEX),
                              QJ_NAMED(CL_INVALID_ARG_VALUE),
                              QJ_NAMED(CL_INVALID_ARG_SIZE),
                              QJ_NAMED(CL_INVALID_WORK_GROUP_SIZE),
                              QJ_NAMED(CL_INVALID_WORK_ITEM_SIZE),
                              QJ_NAMED(CL_INVALID_GLOBAL_WORK_SIZE)};
#undef QJ_NAMED
  const auto* const found = std::ranges::find(kNames, code, [](const auto& n) { return n.first; });
  return found == kNames.end() ? "OpenCL error" : found->second;
}

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
           "gave up on it: 'qjulia doctor' says what works there";
  }
  return "";
}

}  // namespace

std::vector<cl::Platform> platforms() {
  std::vector<cl::Platform> found;
  if (cl::Platform::get(&found) != CL_SUCCESS) return {};
  return found;
}

std::vector<cl::Device> devices(const cl::Platform& platform) {
  std::vector<cl::Device> found;
  if (platform.getDevices(CL_DEVICE_TYPE_ALL, &found) != CL_SUCCESS) return {};
  std::erase_if(found, [](const cl::Device& d) { return !d.getInfo<CL_DEVICE_AVAILABLE>(); });
  return found;
}

DeviceInfo describe(const cl::Device& device, int platform_index, int device_index) {
  const auto type = device.getInfo<CL_DEVICE_TYPE>();
  const cl::Platform platform(device.getInfo<CL_DEVICE_PLATFORM>());
  return {.platform = platform_index,
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
          .native_float_lanes = device.getInfo<CL_DEVICE_NATIVE_VECTOR_WIDTH_FLOAT>(),
          .global_memory = device.getInfo<CL_DEVICE_GLOBAL_MEM_SIZE>(),
          .largest_allocation = device.getInfo<CL_DEVICE_MAX_MEM_ALLOC_SIZE>(),
          .local_memory = device.getInfo<CL_DEVICE_LOCAL_MEM_SIZE>(),
          .largest_work_group = device.getInfo<CL_DEVICE_MAX_WORK_GROUP_SIZE>(),
          .has_double = device.getInfo<CL_DEVICE_DOUBLE_FP_CONFIG>() != 0};
}

bool means_refused_group(int code) {
  return code == CL_INVALID_WORK_GROUP_SIZE || code == CL_INVALID_WORK_ITEM_SIZE;
}

bool is_out_of_memory(const DeviceError& error) { return means_out_of_memory(error.code()); }

bool is_refused_group(const DeviceError& error) { return means_refused_group(error.code()); }

}  // namespace qjulia::device

qjulia::DeviceError::DeviceError(const std::string& device, const std::string& call, int error_code)
    : Error(fmt::format("{} failed on '{}': {} ({}){}", call, device,
                        device::error_name(error_code), error_code, device::advice(error_code))),
      code_(error_code) {}
