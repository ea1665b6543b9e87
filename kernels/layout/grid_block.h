#pragma once
/* A block of a regular grid: nx * ny * ... grid points from grid point (ix, iy, iz) on, numbered x
   fastest, then y. Grid point (i, j, k) is origin + step (i, j, k). Compiled by host and device. */

#include "layout/arguments.h"

QJ_ARGUMENTS(qj_grid_block) {
  real origin_x, origin_y, origin_z, step;
  int nx, ny, ix, iy, iz;
};
