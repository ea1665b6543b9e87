#pragma once
/* How place_vertices finds where a set ends on the edges of a grid. Compiled by host and device. */

#include "layout/arguments.h"

QJ_ARGUMENTS(qj_placement) {
  real origin_x, origin_y, origin_z, step; /* grid point (i, j, k) is origin + step (i, j, k) */
  real reach;     /* differences of orbits that are not known are clamped to it */
  real flatten;   /* factor of differences above the level */
  real slope;     /* |grad F_1| about the surface, a step; 0 where it is not known */
  real stretch;   /* of distances by an iterate */
  real close;     /* a point this near to the set's boundary ends the search, steps */
  int iterations; /* n */
  int tries;      /* of places on an edge, at most */
  int stride;     /* reals in an array of edges */
  int count;      /* edges */
  int share;      /* edges of a work-item */
};
