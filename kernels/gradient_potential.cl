// Gradient of the energy for one iterate: F_1 is a sum of logs, so no versor is needed.
//   dF/da_k = ln|d_k|,   dF/dc_k = -a_k d_k / |d_k|^2,   dF/dS = 1

#include "factor_vector.clh"
#include "lane_math.clh"
#include "layout/gradient_layout.h"
#include "layout/loss.h"

// Lanes run across factors and samples come one by one, so nothing is summed across lanes.
// Work-item (v, c): factors v QJ_WIDTH … and samples c chunk …; rows: one gradient row a chunk.
kernel void gradient_potential(global const real* samples, int stride, int chunk,
                               global const real* map, int factors, global const real* cotangent,
                               global real* rows) {
  int v = (int)get_global_id(0);
  int c = (int)get_global_id(1);
  int map_stride = QJ_MAP_STRIDE(factors);
  if (v * QJ_WIDTH >= map_stride) return;
  lane a = lane_load(MAP_EXPONENTS(map, map_stride), v);
  center_vector centers =
      load_centers(MAP_CENTERS(map, map_stride), map_stride, v, map[QJ_MAP_SLICE]);
  lane log_sum = lane_of(0), x_sum = lane_of(0), y_sum = lane_of(0), z_sum = lane_of(0);
  lane w_sum = lane_of(0);
  real scale_sum = 0;
  int end = min((c + 1) * chunk, stride);
  for (int i = c * chunk; i < end; ++i) {
    real l = cotangent[i];
    if (l == 0) continue;  // saturated, or one-sided and far enough: the same for all work-items
    center_offset d = offset_from(centers, samples, stride, i);
    lane r = l / d.norm2;
    log_sum = fma(lane_of(l), lane_log2(d.norm2), log_sum);
    x_sum = fma(r, d.x, x_sum);
    y_sum = fma(r, d.y, y_sum);
    z_sum = fma(r, d.z, z_sum);
    w_sum = fma(r, d.w, w_sum);
    scale_sum += l;
  }
  global real* row = rows + (size_t)c * QJ_GRADIENT_COLUMNS(factors);
  lane_store(log_sum * ((real)0.5 * QJ_LN2), row + QJ_MAP_EXPONENT * map_stride, v);
  lane_store(-a * x_sum, row + QJ_MAP_CENTER_X * map_stride, v);
  lane_store(-a * y_sum, row + QJ_MAP_CENTER_Y * map_stride, v);
  lane_store(-a * z_sum, row + QJ_MAP_CENTER_Z * map_stride, v);
  lane_store(-a * w_sum, row + QJ_MAP_CENTER_W * map_stride, v);
  if (v == 0) row[QJ_GRADIENT_LOG_SCALE(factors)] = scale_sum;
}
