#pragma once
/// Which device to use where several could be.

#include <string>
#include <vector>

#include "qjulia/device/device.hpp"

namespace qjulia::device {

/// The value of DeviceInfo::estimated_speed.
double estimated_speed(const DeviceInfo& info);

/// Sets `same_as` of each GPU that a better platform shows too: the same PCI address or UUID. A
/// vendor's own platform is better than Mesa's rusticl, which is better than PoCL, which is better
/// than Clover; then one with double precision is better, then the later OpenCL version, then the
/// earlier in the list.
void mark_same_hardware(std::vector<DeviceInfo>& devices);

/// Sets `rank` as `list_devices` says; expects `same_as` and `estimated_speed`.
void rank_devices(std::vector<DeviceInfo>& devices);

/// "P:D".
std::string device_id(const DeviceInfo& info);

}  // namespace qjulia::device
