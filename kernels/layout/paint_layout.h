#pragma once
/* A map's paint in its buffer: a header, then for each cell of its grid, x fastest, what its share
   of the detail lacks of 1, and one real more, so that four can be loaded at the last. Lengths are
   map units. Compiled by host and device. */

#define QJ_PAINT_ORIGIN 0   /* three reals: where cell (0, 0, 0) begins */
#define QJ_PAINT_PER_CELL 3 /* 1 / side of a cell */
#define QJ_PAINT_CELLS 4    /* three numbers of cells */
#define QJ_PAINT_LEAST 7    /* the least lack of a cell */
#define QJ_PAINT_MOST 8     /* the greatest, below 1 */
#define QJ_PAINT_HEADER 12

/* Cells at each end of the grid in which the spline is not evaluated. */
#define QJ_PAINT_MARGIN 1.5f
