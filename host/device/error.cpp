#include "qjulia/error.hpp"

#include <fmt/format.h>

#include "device/opencl.hpp"
#include "device/refused.hpp"

namespace qjulia {
namespace {

/// Not CL_OUT_OF_RESOURCES: that is said of launches too, whatever they lack.
bool means_out_of_memory(int code) {
  return code == CL_MEM_OBJECT_ALLOCATION_FAILURE || code == CL_INVALID_BUFFER_SIZE ||
         code == CL_OUT_OF_HOST_MEMORY;
}

/// What to do about an error; empty where nothing is known.
std::string advice(int code) {
  if (means_out_of_memory(code)) {
    return "; the device has too little memory: fewer factors, samples or points need less, or "
           "choose another device";
  }
  if (code == CL_OUT_OF_RESOURCES) {
    return "; the device has too few registers or too little memory for this launch, or its driver "
           "gave up on it: 'qjulia doctor' says what works there";
  }
  return {};
}

}  // namespace

DeviceError::DeviceError(const std::string& device, const std::string& call, int error_code)
    : Error(fmt::format("{} failed on '{}': {} ({}){}", call, device,
                        device::error_name(error_code), error_code, advice(error_code))),
      code_(error_code) {}

bool device::is_out_of_memory(const DeviceError& error) {
  return means_out_of_memory(error.code());
}

bool device::means_refused_group(int code) {
  return code == CL_INVALID_WORK_GROUP_SIZE || code == CL_INVALID_WORK_ITEM_SIZE;
}

bool device::is_refused_group(const DeviceError& error) {
  return means_refused_group(error.code());
}

}  // namespace qjulia
