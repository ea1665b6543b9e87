#pragma once
/// Caches as limits of kernels.

#include <string>
#include <vector>

namespace qjulia {

/// How fast a CPU reads from a cache, by a kernel whose data just fits there.
struct CacheRoof {
  int level = 1;                    ///< 1, 2 or 3
  double bytes_per_second = 0;      ///< of all processors
  double bytes_per_cpu_second = 0;  ///< 0 where CPU seconds are not known
};

/// ", L1 210 GB/s, L2 …"; empty where there are none.
std::string cache_rates(const std::vector<CacheRoof>& caches);

}  // namespace qjulia
