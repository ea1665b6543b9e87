#pragma once
/* How place_vertices finds where a set ends on the edges of a grid. Compiled by host and device. */

#include "layout/arguments.h"

QJ_ARGUMENTS(qj_placement) {
  real origin_x, origin_y, origin_z, step; /* grid point (i, j, k) is origin + step (i, j, k) */
  real reach;     /* differences from the level are clamped to it at ends of unknown orbit */
  real flatten;   /* differences above the level are multiplied by it */
  real slope;     /* |grad F_1| about the surface, per step; 0 if it is not known */
  real stretch;   /* factor by which an iterate stretches distances */
  real close;     /* a point this near to the set's boundary ends the search; steps */
  int iterations; /* n */
  int tries;      /* most places tried on an edge */
  int stride;     /* reals in an array of edges */
  int count;      /* edges */
  int share;      /* edges of a work-item */
};
