#pragma once
/* What the energy sums over samples. Compiled by host and device. */

#include "layout/arguments.h"

#define QJ_LOSS_TANH 0     /* E = - sum w s tanh(alpha (F - t)): Kim 2015, Eq. 8 */
#define QJ_LOSS_DISTANCE 1 /* E = 1/2 sum w r^2: regression of F_1 to signed distance */
/* E = sum w t F: cotangents w t that the host has found, in kernels built with QJ_LINEAR_LOSS. */
#define QJ_LOSS_LINEAR 2

/* Arrays in a sample buffer, each of `stride` reals. */
#define QJ_SAMPLE_X 0
#define QJ_SAMPLE_Y 1
#define QJ_SAMPLE_Z 2
#define QJ_SAMPLE_W 3 /* from the map's slice */
#define QJ_SAMPLE_WEIGHT 4
#define QJ_SAMPLE_TARGET 5
#define QJ_SAMPLE_SIDE 6
#define QJ_SAMPLE_ARRAYS 7

/* Scalars of the kernels that sum the energy. */
QJ_ARGUMENTS(qj_energy_arguments) {
  real alpha;
  int loss;
  int stride;  /* samples, padded */
  int vectors; /* of samples, taken by a work-item */
  int items;   /* work-items, or groups of them */
  int factors;
  int iterations;
};
