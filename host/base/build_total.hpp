#pragma once
/// What it took to build the programs that kernels are in.

namespace qjulia::base {

struct BuildTotal {
  int compiled = 0;    ///< by drivers, from source
  int loaded = 0;      ///< from compiled programs that were kept on disk
  int replaced = 0;    ///< of those compiled: what was kept was damaged or did not load
  double seconds = 0;  ///< wall time of all
};

/// All that this process has built so far, for all of its devices.
BuildTotal build_total();

}  // namespace qjulia::base
