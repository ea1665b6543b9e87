// Cholesky's factorisation H = R^T R by blocks of rows, the largest index last: a block's own
// triangle, its rows right of that, then (panel_products in gauss_newton.cl) what they take from
// the rows below. H is an `order` x `order` matrix by rows, of which only the upper triangle is
// used; R takes its place. H comes from a matrix in single precision, and R is
// rounded to it before it is used.

#include "lanes.clh"
#include "layout/panel_layout.h"

// Entry (i, j) of a symmetric matrix whose upper triangle is there by rows.
static inline real entry(global const float* upper, int stride, int i, int j) {
  return upper[(size_t)min(i, j) * stride + max(i, j)];
}

// The diagonal of the matrix whose i-th row and column are the place[i]-th of `upper`. Work-item i.
kernel void diagonal(int n, int stride, global const int* place, global const float* upper,
                     global real* entries) {
  int i = (int)get_global_id(0);
  if (i < n) entries[i] = entry(upper, stride, place[i], place[i]);
}

// The same matrix scaled, s_i s_j H_ij, beside its diagonal divided by `more`, on it one, and
// continued as the identity. Work-item (column, row).
kernel void unit_diagonal(int n, int stride, global const int* place, global const float* upper,
                          global const real* scale, real more, int order, global real* matrix) {
  int j = (int)get_global_id(0), i = (int)get_global_id(1);
  if (j >= order || i > j) return;
  real value = i == j;
  if (i < j && j < n) {
    value = entry(upper, stride, place[i], place[j]) * scale[i] * scale[j] / more;
  }
  matrix[(size_t)i * order + j] = value;
}

// Rows of R in single precision, from `first`. Work-item (column, row of the block).
kernel void narrowed(int order, int first, global const real* matrix, global float* block) {
  int j = (int)get_global_id(0), i = (int)get_global_id(1);
  if (j >= order || first + i > j) return;
  block[(size_t)i * order + j] = (float)matrix[(size_t)(first + i) * order + j];
}

// The triangle of QJ_CHOLESKY_BLOCK rows from `first`. One group of any size. A pivot that is not
// positive leaves NaN, in all rows after it too. last_pivot: that of the triangle's last row.
kernel void cholesky_triangle(int order, int first, global real* matrix, global real* last_pivot) {
  int member = (int)get_local_id(0), members = (int)get_local_size(0);
  global real* block = matrix + (size_t)first * order + first;
  for (int p = 0; p < QJ_CHOLESKY_BLOCK; ++p) {
    global real* row = block + (size_t)p * order;
    real pivot = sqrt(row[p]);
    if (member == 0) *last_pivot = pivot;
    barrier(CLK_GLOBAL_MEM_FENCE);
    for (int c = p + member; c < QJ_CHOLESKY_BLOCK; c += members) {
      row[c] = c > p ? row[c] / pivot : pivot;
    }
    barrier(CLK_GLOBAL_MEM_FENCE);
    for (int r = p + 1 + member; r < QJ_CHOLESKY_BLOCK; r += members) {
      real factor = row[r];
      global real* other = block + (size_t)r * order;
      for (int c = r; c < QJ_CHOLESKY_BLOCK; ++c) other[c] -= factor * row[c];
    }
    barrier(CLK_GLOBAL_MEM_FENCE);
  }
}

// The same rows' columns right of the triangle: R_12 = R_11^-T H_12, also as a panel whose samples
// are the block's rows. Work-item v: the v-th QJ_WIDTH columns.
kernel void cholesky_rows(int order, int first, global real* matrix, global real* panels) {
  int column = first + QJ_CHOLESKY_BLOCK + (int)get_global_id(0) * QJ_WIDTH;
  if (column >= order) return;
  global real* h = matrix + (size_t)first * order;
  global real* panel = panels +
                       (size_t)(column / QJ_PANEL_TILE) * QJ_CHOLESKY_BLOCK * QJ_PANEL_TILE +
                       column % QJ_PANEL_TILE;
  for (int p = 0; p < QJ_CHOLESKY_BLOCK; ++p) {
    global real* at = h + (size_t)p * order + column;
    lane sum = lane_load(at, 0);
    for (int i = 0; i < p; ++i) {
      sum -= h[(size_t)i * order + first + p] * lane_load(panel + i * QJ_PANEL_TILE, 0);
    }
    sum /= h[(size_t)p * order + first + p];
    lane_store(sum, at, 0);
    lane_store(sum, panel + p * QJ_PANEL_TILE, 0);
  }
}
