#pragma once
/// Large pages for large arrays.

#include <cstddef>

namespace qjulia::base {

/// Asks the system for pages of 2 MiB in place of 4 KiB for memory that nothing has written to yet:
/// an array of 100 MB then takes 50 page faults at first use, not 25,000, which cost more than a
/// pass over it. Small arrays, and systems without such pages, stay as they are.
void use_large_pages(void* begin, std::size_t bytes);

}  // namespace qjulia::base
