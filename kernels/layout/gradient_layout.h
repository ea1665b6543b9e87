#pragma once
/* A row of gradient sums: the map's component arrays (map_layout.h, without its header), then the
   derivative by the log scale. Compiled by host and device. */

#include "layout/map_layout.h"

#define QJ_GRADIENT_LOG_SCALE(factors) (QJ_MAP_COMPONENTS * QJ_MAP_STRIDE(factors))
/* Reals in a row, a multiple of the widest lane. */
#define QJ_GRADIENT_COLUMNS(factors) (QJ_GRADIENT_LOG_SCALE(factors) + 16)

/* Lanes that gradient_orbit keeps of each iterate but the last: the versor and F. */
#define QJ_ORBIT_LANES 5
