#pragma once
/// The OpenCL headers with this project's settings, and what every file of this room shares.
/// Included by this room's sources only.

#define CL_HPP_TARGET_OPENCL_VERSION 120
#define CL_HPP_MINIMUM_OPENCL_VERSION 120
#define CL_TARGET_OPENCL_VERSION 120
#include <sys/types.h>

#include <CL/opencl.hpp>
#include <string>
#include <vector>

#include "qjulia/device/device.hpp"

namespace qjulia::device {

/// Throws DeviceError where this process was forked from the one that `device` was opened in, or,
/// for `platforms`, OpenCL was first used in: in a forked process the driver's threads are gone,
/// and calls would wait for ever.
/// @param call what the error says could not be done.
void expect_own_process(pid_t opened_by, const std::string& device, const std::string& call);

/// The loader's platforms that answer; empty when there is no loader configuration at all.
/// @param code what the loader says, where it is wanted.
/// @throws DeviceError in a process forked from one that has used OpenCL
std::vector<cl::Platform> platforms(cl_int* code = nullptr);

/// A platform's devices that answer; empty when it has none or is broken.
/// @param code what the platform says, where it is wanted.
std::vector<cl::Device> devices(const cl::Platform& platform, cl_int* code = nullptr);

/// All devices as `list_devices` gives them.
struct Inventory {
  std::vector<DeviceInfo> devices;
  std::vector<std::string> problems;  ///< why a platform, or all of them, shows none
};
Inventory take_inventory();

/// Without what other devices have a say in: its rank, and whether it is one of them.
DeviceInfo describe(const cl::Device& device, int platform_index, int device_index);

/// Whether a launch's groups were too large for the device.
bool means_refused_group(cl_int code);

}  // namespace qjulia::device
