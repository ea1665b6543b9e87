#include <fmt/format.h>

#include "qjulia/error.hpp"
#include "qjulia/versor.hpp"

namespace qjulia {

void NoiseVersor::validate() const {
  if (octaves < 1 || octaves > kMostOctaves) {
    throw InputError(
        fmt::format("the map's noise.octaves is {}: it must be 1 to {}", octaves, kMostOctaves));
  }
  if (!(scale >= kLeastScale && scale <= kMostScale)) {
    throw InputError(fmt::format("the map's noise.scale is {}: it must be {} to {}", scale,
                                 kLeastScale, kMostScale));
  }
  constexpr double kMost = 1e9;
  if (origin.cwiseAbs().maxCoeff() <= kMost) return;
  throw InputError("the map's noise.origin must have finite numbers within ±1e9");
}

}  // namespace qjulia
