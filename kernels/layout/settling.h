#pragma once
/* What settle_points asks of interpolated images. Compiled by host and device. */

#include "layout/arguments.h"

QJ_ARGUMENTS(qj_settling) {
  real below, level, above; /* F_1 and F_2 are decided below the one, above the other */
  int node_columns;         /* of the lattice */
  int spacing;              /* of its nodes, grid points */
};
