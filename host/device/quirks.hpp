#pragma once
/// What must be known of particular OpenCL implementations, all in one place.

#include <string>

#include "qjulia/device/device.hpp"

namespace qjulia::device {

bool is_pocl(const DeviceInfo& info);

/// Mesa's llvmpipe: a CPU whose compiler makes its vectors out of neighbouring work-items.
bool is_llvmpipe(const DeviceInfo& info);

/// Floats in one of the device's vector registers. PoCL 3.1 says 1 of every CPU for aarch64.
/// @param said by the driver.
unsigned float_lanes(DeviceKind kind, unsigned said);

/// The layout a device is chosen with. CPUs need explicit vectors: PoCL does not vectorise across
/// work-items. GPUs are made of lanes: one to each work-item.
Layout suited_layout(const DeviceInfo& info);

/// Whether the driver compiles kernels whose work-items wait for one another rightly or wrongly by
/// chance. PoCL since 5.0 remembers by their addresses which values are the same for a whole group,
/// also when others have taken these addresses: of 80 compilations of gradient_orbit with groups of
/// 16, 11 were wrong (PoCL 6.0).
bool may_miscompile_barriers(const DeviceInfo& info);

/// Whether kernels with these settings have barriers.
bool has_barriers(const Tuning& tuning);

/// The settings of a layout, as far as the device's groups are large enough for them and its
/// compiler can be trusted with them.
/// @param lane_width settings for that width; 0: for the width that suits the device.
Tuning default_tuning(const DeviceInfo& info, Precision precision, Layout layout,
                      int lane_width = 0);

/// Work-items of a work-group where a kernel has no wish of its own. It is fixed for a width, since
/// PoCL compiles a kernel anew for every group size it meets.
std::size_t preferred_group_size(const DeviceInfo& info, int lane_width);

/// Whether two queues of a process must not run kernels built from the same source with the same
/// options. PoCL 3.1 has aborted in pocl_release_dlhandle_cache then: it keeps builds of a kernel
/// for grids of different widths, but counts their uses by source and group size alone. Three of
/// 129 batches of three to six fits at a time ended so, and none of 275 with kernels of their own.
bool needs_kernels_of_its_own(const DeviceInfo& info);

/// The source as the driver's compiler should get it. PoCL's own functions for aarch64 are compiled
/// for features that its kernels lack, so that LLVM inlines none of them: in the plain walk over
/// factors all but a few instructions passed arguments through memory.
std::string source_for(const DeviceInfo& info, const std::string& source);

/// Whether the driver compiles by way of files in base::kernel_cache.
bool compiles_on_disk(const DeviceInfo& info);

/// Whether loading compiled programs is faster than the driver's own way from source.
bool gains_by_stored_programs(const DeviceInfo& info);

/// Whether it is worth a file for each build to know later that the driver crashed in it. CPUs'
/// drivers compile most of a kernel at its first launch, outside of the build.
bool may_crash_in_builds(const DeviceInfo& info);

/// Whether the loops of a work-item end after 65,535 turns in all, without an error, as llvmpipe's
/// do (LP_MAX_TGSI_LOOP_ITERATIONS in Mesa's lp_bld_limits.h).
bool cuts_long_loops(const DeviceInfo& info);

/// How many edges, rays or the like each lane takes in turn.
/// @param usual the number where loops may be long; else it is one.
std::size_t share_of_lane(const DeviceInfo& info, std::size_t usual);

}  // namespace qjulia::device
