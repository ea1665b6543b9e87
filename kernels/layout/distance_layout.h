#pragma once
/* What a distance modulus keeps in a map's buffer: a header, then the coefficients of its grid, x
   fastest, and one real more, so that four can be loaded at the last. Lengths are map units.
   Compiled by host and device. */

#define QJ_DISTANCE_PER_SHELL 0 /* 1 / delta */
#define QJ_DISTANCE_INRADIUS 1  /* r_in */
#define QJ_DISTANCE_FOURTH 2    /* what W^2 counts: 1, or 0 where it is ignored */
#define QJ_DISTANCE_ORIGIN 3    /* three reals: where cell (0, 0, 0) begins */
#define QJ_DISTANCE_STEP 6      /* side of a cell */
#define QJ_DISTANCE_CELLS 7     /* three numbers of cells */
#define QJ_DISTANCE_SLOPE 10    /* the spline changes by at most so much a cell */
#define QJ_DISTANCE_HEADER 16

/* Cells at each end of the grid in which the spline is not evaluated. */
#define QJ_DISTANCE_MARGIN 4
