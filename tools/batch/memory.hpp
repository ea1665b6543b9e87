#pragma once
/// The memory of this process.

#include <cstdint>

namespace qjulia::batch {

/// The most that it had at once since `forget_most_memory`, in bytes; 0 where the system does not
/// say.
std::uint64_t most_memory();

/// Counts anew from what it has now. Where the system cannot, `most_memory` counts from the
/// beginning of the process.
void forget_most_memory();

}  // namespace qjulia::batch
