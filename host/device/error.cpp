#include "qjulia/error.hpp"

#include <fmt/format.h>

#include "device/opencl.hpp"
#include "device/out_of_memory.hpp"

namespace qjulia {
namespace {

/// Not CL_OUT_OF_RESOURCES: that is said of launches too, whatever they lack.
bool means_out_of_memory(int code) {
  return code == CL_MEM_OBJECT_ALLOCATION_FAILURE || code == CL_INVALID_BUFFER_SIZE ||
         code == CL_OUT_OF_HOST_MEMORY;
}

}  // namespace

DeviceError::DeviceError(const std::string& device, const std::string& call, int error_code)
    : Error(fmt::format(
          "{} failed on '{}': {} ({}){}", call, device, device::error_name(error_code), error_code,
          means_out_of_memory(error_code)
              ? "; the device has too little memory: fewer factors, samples or points "
                "need less, or choose another --device"
              : "")),
      code_(error_code) {}

bool device::is_out_of_memory(const DeviceError& error) {
  return means_out_of_memory(error.code());
}

}  // namespace qjulia
