#pragma once
/// What must be known of particular OpenCL implementations, all in one place.

#include "qjulia/device.hpp"

namespace qjulia::device {

/// The settings a device is chosen with. CPUs need explicit vectors: PoCL does not vectorise across
/// work-items. Mesa's llvmpipe does, and GPUs are made of lanes: one each.
/// @param lane_width settings for that width; 0: for the width that suits the device.
Tuning default_tuning(const DeviceInfo& info, Precision precision, int lane_width = 0);

/// Work-items of a work-group where a kernel has no wish of its own. It is fixed, since PoCL
/// compiles a kernel anew for every group size it meets.
std::size_t preferred_group_size(const DeviceInfo& info);

}  // namespace qjulia::device
