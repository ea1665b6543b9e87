#include "base/large_pages.hpp"

#include <sys/mman.h>

#include <cstdint>

namespace qjulia::base {

void use_large_pages(void* begin, std::size_t bytes) {
  constexpr std::uintptr_t kPage = std::uintptr_t{1} << 21;
  const auto address = reinterpret_cast<std::uintptr_t>(begin);
  const std::uintptr_t first = (address + kPage - 1) / kPage * kPage;
  const std::uintptr_t last = (address + bytes) / kPage * kPage;
  if (first >= last) return;
  // Advice only: where it is refused, all stays as it was.
  (void)madvise(static_cast<std::byte*>(begin) + (first - address), last - first, MADV_HUGEPAGE);
}

}  // namespace qjulia::base
