#pragma once
/// Large pages for large arrays.

#include <sys/mman.h>

#include <cstddef>
#include <cstdint>

namespace qjulia::base {

/// Asks the system for pages of 2 MiB in place of 4 KiB for memory that nothing has written to yet:
/// an array of 100 MB then takes 50 page faults at first use, not 25,000, which cost more than a
/// pass over it. Small arrays, and systems without such pages, stay as they are.
inline void use_large_pages(void* begin, std::size_t bytes) {
  constexpr std::uintptr_t kPage = std::uintptr_t{1} << 21;
  const auto address = reinterpret_cast<std::uintptr_t>(begin);
  const std::uintptr_t first = (address + kPage - 1) / kPage * kPage;
  const std::uintptr_t last = (address + bytes) / kPage * kPage;
  if (first >= last) return;
  // Advice only: where it is refused, all stays as it was.
  (void)madvise(static_cast<std::byte*>(begin) + (first - address), last - first, MADV_HUGEPAGE);
}

}  // namespace qjulia::base
