#pragma once
/* Jacobian panels: unknowns in the order of a gradient row (gradient_layout.h), cut into tiles of
   QJ_PANEL_TILE; within a tile, sample after sample, QJ_PANEL_TILE reals each. The number of tiles
   is even, so that a kernel can work on two side by side. Compiled by host and device. */

#include "layout/arguments.h"
#include "layout/gradient_layout.h"

#define QJ_PANEL_TILE 16
#define QJ_PANEL_TILES(factors) ((QJ_GRADIENT_COLUMNS(factors) / QJ_PANEL_TILE + 1) / 2 * 2)
/* Rows and columns of the Gauss-Newton matrix as the device keeps it. */
#define QJ_PANEL_ORDER(factors) (QJ_PANEL_TILES(factors) * QJ_PANEL_TILE)

/* Panels of matching pursuit: tiles of centres, padded as a map's factors are, then one that begins
   with the column of ones and that of residuals. */
#define QJ_PURSUIT_TILES(centers) ((QJ_MAP_STRIDE(centers) / QJ_PANEL_TILE + 2) / 2 * 2)
#define QJ_PURSUIT_ORDER(centers) (QJ_PURSUIT_TILES(centers) * QJ_PANEL_TILE)
#define QJ_PURSUIT_ONES(centers) QJ_MAP_STRIDE(centers)
#define QJ_PURSUIT_RESIDUALS(centers) (QJ_MAP_STRIDE(centers) + 1)

/* Panels of the coarse space over blocks of factors: the log scale's column, then one for each
   block and component of a map. */
#define QJ_COARSE_TILES(blocks) ((QJ_MAP_COMPONENTS * (blocks) / QJ_PANEL_TILE + 2) / 2 * 2)
#define QJ_COARSE_ORDER(blocks) (QJ_COARSE_TILES(blocks) * QJ_PANEL_TILE)

/* Scalars of the kernels that fill panels. */
QJ_ARGUMENTS(qj_panel_arguments) {
  real alpha;
  real slice; /* W of the samples */
  int loss;
  int stride; /* samples, padded */
  int step;   /* every step-th sample is taken */
  int first;  /* number of the first one taken in this chunk */
  int chunk;  /* samples the panels hold */
  int block;  /* samples of a work-item */
  int count;  /* factors of a block, or centres */
};
