#include "qjulia/error.hpp"

#include <fmt/format.h>

#include "device/opencl.hpp"

namespace qjulia {

DeviceError::DeviceError(const std::string& device, const std::string& call, int error_code)
    : Error(fmt::format("{} failed on '{}': {} ({})", call, device, device::error_name(error_code),
                        error_code)),
      code_(error_code) {}

}  // namespace qjulia
