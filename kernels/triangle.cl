// The inverse X of an upper triangular matrix R, and products of X with vectors. R and X are
// `order` x `order`, by rows, and the order is a multiple of QJ_CHOLESKY_BLOCK. X is made by blocks
// of as many rows, the last block first: X_1 = R_11^-1 (I - R_12 X_2). Below the diagonal X is zero
// in the diagonal blocks and undefined elsewhere.

#include "lanes.clh"
#include "layout/panel_layout.h"
#include "layout/triangle_layout.h"

// I - R_12 X_2 for the block of rows from `first`. Work-item (v, r): the v-th QJ_WIDTH columns from
// `first` on, the r-th QJ_INVERSE_ROWS rows.
kernel void inverse_rows(int order, int first, global const real* triangle, global real* inverse) {
  int column = first + (int)get_global_id(0) * QJ_WIDTH;
  int row = first + (int)get_global_id(1) * QJ_INVERSE_ROWS;
  if (column >= order) return;
  lane sums[QJ_INVERSE_ROWS];
  for (int r = 0; r < QJ_INVERSE_ROWS; ++r) sums[r] = (lane)0;
  int end = column + QJ_WIDTH;
  for (int k = first + QJ_CHOLESKY_BLOCK; k < end; ++k) {
    lane x = lane_load(inverse + (size_t)k * order + column, 0);
    global const real* r_12 = triangle + (size_t)row * order + k;
    for (int r = 0; r < QJ_INVERSE_ROWS; ++r) sums[r] -= r_12[(size_t)r * order] * x;
  }
  for (int r = 0; r < QJ_INVERSE_ROWS; ++r) {
    global real* entries = inverse + (size_t)(row + r) * order;
    lane_store(sums[r], entries + column, 0);
    if (row + r >= column && row + r < end) entries[row + r] = 1;
  }
}

// Solves R_11 X_1 = these rows in place, by back substitution. Work-item v: the v-th QJ_WIDTH
// columns from `first` on.
kernel void inverse_triangle(int order, int first, global const real* triangle,
                             global real* inverse) {
  int column = first + (int)get_global_id(0) * QJ_WIDTH;
  if (column >= order) return;
  global const real* r_11 = triangle + (size_t)first * order + first;
  global real* x = inverse + (size_t)first * order + column;
  for (int p = QJ_CHOLESKY_BLOCK - 1; p >= 0; --p) {
    global const real* row = r_11 + (size_t)p * order;
    lane sum = lane_load(x + (size_t)p * order, 0);
    for (int q = p + 1; q < QJ_CHOLESKY_BLOCK; ++q) {
      sum -= row[q] * lane_load(x + (size_t)q * order, 0);
    }
    lane_store(sum / row[p], x + (size_t)p * order, 0);
  }
}

// Parts of the product of an upper triangle with a vector: part p of row i is the sum over every
// QJ_TRIANGLE_PARTS-th column from i + p on. Work-item (p, i).
kernel void triangle_times(int order, global const real* triangle, global const real* vector,
                           global real* parts) {
  int p = (int)get_global_id(0), i = (int)get_global_id(1);
  if (p >= QJ_TRIANGLE_PARTS) return;
  global const real* row = triangle + (size_t)i * order;
  real sum = 0;
  for (int j = i + p; j < order; j += QJ_TRIANGLE_PARTS) sum += row[j] * vector[j];
  parts[(size_t)p * order + i] = sum;
}

// The same of the transposed triangle: part p of column j is the sum over every
// QJ_TRIANGLE_PARTS-th row from p to the diagonal. Work-item (j, p).
kernel void transposed_triangle_times(int order, global const real* triangle,
                                      global const real* vector, global real* parts) {
  int j = (int)get_global_id(0), p = (int)get_global_id(1);
  if (j >= order) return;
  real sum = 0;
  for (int i = p; i <= j; i += QJ_TRIANGLE_PARTS)
    sum += triangle[(size_t)i * order + j] * vector[i];
  parts[(size_t)p * order + j] = sum;
}
