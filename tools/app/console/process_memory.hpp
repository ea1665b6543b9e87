#pragma once
/// How this process asks the system for memory.

namespace qjulia::tools {

/// Keeps freed memory for later allocations, in large pages. Arrays of many megabytes come and go
/// in all commands, and a page fault for each page of each costs more than a pass over it. Before
/// other threads start. Elsewhere than with glibc it does nothing.
void keep_freed_memory();

}  // namespace qjulia::tools
