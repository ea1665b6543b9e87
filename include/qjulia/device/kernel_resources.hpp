#pragma once
/// What a compiled kernel needs of its device.

#include <cstdint>
#include <optional>

namespace qjulia {

/// What a kernel needs of a device, as the driver reports it.
struct KernelResources {
  std::uint64_t group_size = 0;      ///< work-items of the largest group that it can have
  std::uint64_t group_multiple = 0;  ///< work-items that the device takes together
  std::uint64_t local_bytes = 0;     ///< of a group
  std::uint64_t private_bytes = 0;   ///< of a work-item, in memory
  // What a work-item needs, where the driver answers a question of its vendor's.
  std::optional<std::uint64_t> registers{};
  std::optional<std::uint64_t> spilled_bytes{};
  /// Work-items for which the registers of a compute unit suffice at once.
  std::optional<std::uint64_t> resident_items{};
};

}  // namespace qjulia
