#include "console/process_memory.hpp"

#include <cstdlib>
#include <limits>
#include <memory>

#include "base/large_pages.hpp"

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#include <malloc.h>
#include <sys/resource.h>

namespace qjulia::tools {

void keep_freed_memory() {
  // One heap for all threads: the others that glibc makes have no room for large arrays.
  mallopt(M_ARENA_MAX, 1);
  constexpr int kHeap = 1 << 30;  // bytes; larger arrays are given back one by one
  mallopt(M_MMAP_THRESHOLD, kHeap);
  mallopt(M_TRIM_THRESHOLD, std::numeric_limits<int>::max());
  for (const auto limited : {RLIMIT_AS, RLIMIT_DATA}) {
    rlimit limit{};
    if (getrlimit(limited, &limit) != 0 || limit.rlim_cur != RLIM_INFINITY) return;
  }
  // Only addresses: what is written to becomes memory.
  constexpr std::size_t kReserved = kHeap - (1 << 20);
  const std::unique_ptr<void, void (*)(void*)> reserved(std::malloc(kReserved), std::free);
  if (reserved) base::use_large_pages(reserved.get(), kReserved);
}

}  // namespace qjulia::tools
#else
void qjulia::tools::keep_freed_memory() {}
#endif
