#pragma once
/* A table of where one iterate takes points of four dimensions (image_table.clh). Compiled by host
   and device. */

/* Reals that describe it. Nodes lie at origin + step (i, j, k, l), the same along all four axes. */
#define QJ_TABLE_ORIGIN 0
#define QJ_TABLE_STEP 1
#define QJ_TABLE_BRICKS 2     /* along an axis */
#define QJ_TABLE_FIELD 3      /* F where a field holds 0 */
#define QJ_TABLE_FIELD_STEP 4 /* F for each step of a field */
#define QJ_TABLE_OUTER 5      /* lower bounds of bricks outside begin here */
#define QJ_TABLE_SIZE 6

/* A brick has 4 x 4 x 4 x 4 cells, and the nodes at their corners. */
#define QJ_TABLE_CELLS 4
#define QJ_TABLE_SIDE 5
#define QJ_TABLE_NODES 625

/* What the directory says of a brick: its number if it has data; QJ_TABLE_INSIDE if F is below the
   inner level in all of it; QJ_TABLE_OUTSIDE - b if F is above QJ_TABLE_OUTER + b / 64. */
#define QJ_TABLE_INSIDE (-1)
#define QJ_TABLE_OUTSIDE (-2)
#define QJ_TABLE_PER_BOUND 64

/* A component of a versor is stored as a signed byte, so many times as large: nodes are fitted, and
   may lie outside the unit ball. */
#define QJ_TABLE_VERSOR 70
