#pragma once
/// The OpenCL headers with this project's settings, and what every file of this room shares.
/// Included by this room's sources only.

#define CL_HPP_TARGET_OPENCL_VERSION 120
#define CL_HPP_MINIMUM_OPENCL_VERSION 120
#define CL_TARGET_OPENCL_VERSION 120
#include <CL/opencl.hpp>
#include <string>
#include <vector>

#include "qjulia/device.hpp"

namespace qjulia::device {

/// The loader's platforms that answer; empty when there is no loader configuration at all.
std::vector<cl::Platform> platforms();

/// A platform's devices that answer; empty when it has none or is broken.
std::vector<cl::Device> devices(const cl::Platform& platform);

DeviceInfo describe(const cl::Device& device, int platform_index, int device_index);

/// Whether a launch's groups were too large for the device.
bool means_refused_group(cl_int code);

}  // namespace qjulia::device
