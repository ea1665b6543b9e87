// Sums in a fixed order, so that results repeat bit for bit.

#include "lanes.clh"

// out[b][c] = sum of in[r][c] over the rows r of block b, compensated (Kahan).
kernel void sum_row_blocks(global const real* in, int rows, int columns, int block,
                           global real* out) {
  int c = (int)get_global_id(0);
  int b = (int)get_global_id(1);
  if (c >= columns) return;
  int end = min((b + 1) * block, rows);
  real sum = 0, lost = 0;
  for (int r = b * block; r < end; ++r) {
    real term = in[(size_t)r * columns + c] - lost;
    real next = sum + term;
    lost = (next - sum) - term;
    sum = next;
  }
  out[(size_t)b * columns + c] = sum;
}
