#pragma once
/// The leaves of a noise, in order, are what devices expect.

#include "layout/noise_layout.h"

namespace qjulia::map {

static_assert(QJ_NOISE_OCTAVES == 0 && QJ_NOISE_SCALE == 1 && QJ_NOISE_SEED == 2 &&
              QJ_NOISE_COMPONENTS == 4 && QJ_NOISE_ORIGIN == 5 && QJ_NOISE_SIZE == 8);

}  // namespace qjulia::map
