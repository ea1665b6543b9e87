#pragma once
/// What must be known of particular OpenCL implementations, all in one place.

#include "qjulia/device.hpp"

namespace qjulia::device {

/// Lanes one work-item should compute. CPUs need explicit vectors: PoCL does not vectorise across
/// work-items. Mesa's llvmpipe does, and GPUs are made of lanes: one each.
int preferred_lane_width(const DeviceInfo& info, Precision precision);

}  // namespace qjulia::device
