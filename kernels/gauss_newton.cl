// The Gauss-Newton matrix H = J^T W J over samples: J of F_1 by all unknowns, W at F_n. J is packed
// in panels (layout/panel_layout.h), a chunk of samples at a time, and H gathers the chunks'
// products.

#include "factor_vector.clh"
#include "lane_math.clh"
#include "layout/panel_layout.h"
#include "loss.clh"

#define PANEL_ROWS 8     // rows of a register tile of H
#define PANEL_VECTORS 2  // vectors of QJ_WIDTH columns of a register tile

// W of sample i, whose F_n is field[i].
static inline real curvature_at(global const real* samples, int stride, int i, int loss,
                                global const real* field, real alpha) {
  return loss_curvature(loss, field[i], samples[QJ_SAMPLE_WEIGHT * stride + i],
                        samples[QJ_SAMPLE_TARGET * stride + i],
                        samples[QJ_SAMPLE_SIDE * stride + i], alpha);
}

// Writes sqrt(W) J of every `step`-th sample, from the first-th such one, into panels of `chunk`
// samples. Samples past the end count as weight 0. The factors come in blocks of `count`, each a
// map of its own, and the panels of each block have its log scale, too. Work-item (v, b, m):
// factors v QJ_WIDTH … of block m, samples b block … of the chunk. field: F_n of all factors.
kernel void jacobian_panels(qj_panel_arguments with, global const real* samples,
                            global const real* maps, global const real* field,
                            global real* panels) {
  int v = (int)get_global_id(0);
  int begin = (int)get_global_id(1) * with.block;
  int stride = with.stride, chunk = with.chunk;
  global const real* map = maps + get_global_id(2) * QJ_MAP_SIZE(with.count);
  panels += get_global_id(2) * QJ_PANEL_ORDER(with.count) * chunk;
  int map_stride = QJ_MAP_STRIDE(with.count);
  if (v * QJ_WIDTH >= map_stride) return;
  lane a = lane_load(MAP_EXPONENTS(map, map_stride), v);
  center_vector centers = load_centers(MAP_CENTERS(map, map_stride), map_stride, v, with.slice);
  int tile = v * QJ_WIDTH / QJ_PANEL_TILE;
  int component_tiles = map_stride / QJ_PANEL_TILE;
  size_t panel = (size_t)chunk * QJ_PANEL_TILE;
  global real* out = panels + tile * panel + v * QJ_WIDTH % QJ_PANEL_TILE;
  int end = min(begin + with.block, chunk);
  for (int s = begin; s < end; ++s) {
    int number = (with.first + s) * with.step;
    int i = min(number, stride - 1);
    real w = curvature_at(samples, stride, i, with.loss, field, with.alpha);
    real root = number < stride ? sqrt(w) : (real)0;
    center_offset d = offset_from(centers, samples, stride, i);
    lane r = -a * root / d.norm2;
    global real* at = out + s * QJ_PANEL_TILE;
    lane_store(lane_log2(d.norm2) * (root * (real)0.5 * QJ_LN2), at, 0);
    lane_store(r * d.x, at + QJ_MAP_CENTER_X * component_tiles * panel, 0);
    lane_store(r * d.y, at + QJ_MAP_CENTER_Y * component_tiles * panel, 0);
    lane_store(r * d.z, at + QJ_MAP_CENTER_Z * component_tiles * panel, 0);
    lane_store(r * d.w, at + QJ_MAP_CENTER_W * component_tiles * panel, 0);
    if (v == 0) {
      // The log scale's tile, and the tile that makes their number even.
      for (int t = QJ_MAP_COMPONENTS * component_tiles; t < QJ_PANEL_TILES(with.count); ++t) {
        for (int j = 0; j < QJ_PANEL_TILE; ++j) panels[t * panel + s * QJ_PANEL_TILE + j] = 0;
      }
      panels[QJ_MAP_COMPONENTS * component_tiles * panel + s * QJ_PANEL_TILE] = root;
    }
  }
}

// The panels of matching pursuit (layout/panel_layout.h), for F linear in exponents: sqrt(W) times
// ln |x - c| for every centre, 1, and F - target. Samples and work-items as in jacobian_panels.
// center_arrays: X, Y, Z, W of QJ_MAP_STRIDE(count) each.
kernel void pursuit_panels(qj_panel_arguments with, global const real* samples,
                           global const real* center_arrays, global const real* field,
                           global real* panels) {
  int v = (int)get_global_id(0);
  int begin = (int)get_global_id(1) * with.block;
  int stride = with.stride, chunk = with.chunk;
  int center_stride = QJ_MAP_STRIDE(with.count);
  if (v * QJ_WIDTH >= center_stride) return;
  center_vector centers = load_centers(center_arrays, center_stride, v, with.slice);
  size_t panel = (size_t)chunk * QJ_PANEL_TILE;
  global real* out = panels + v * QJ_WIDTH / QJ_PANEL_TILE * panel + v * QJ_WIDTH % QJ_PANEL_TILE;
  int end = min(begin + with.block, chunk);
  for (int s = begin; s < end; ++s) {
    int number = (with.first + s) * with.step;
    int i = min(number, stride - 1);
    real w = curvature_at(samples, stride, i, with.loss, field, with.alpha);
    real root = number < stride ? sqrt(w) : (real)0;
    center_offset d = offset_from(centers, samples, stride, i);
    lane_store(lane_log2(d.norm2) * (root * (real)0.5 * QJ_LN2), out + s * QJ_PANEL_TILE, 0);
    if (v == 0) {
      for (int t = center_stride / QJ_PANEL_TILE; t < QJ_PURSUIT_TILES(with.count); ++t) {
        for (int j = 0; j < QJ_PANEL_TILE; ++j) panels[t * panel + s * QJ_PANEL_TILE + j] = 0;
      }
      global real* more = panels + center_stride / QJ_PANEL_TILE * panel + s * QJ_PANEL_TILE;
      more[0] = root;
      more[1] = root * (field[i] - samples[QJ_SAMPLE_TARGET * stride + i]);
    }
  }
}

// H's diagonal, over all samples: sums of W J^2. Work-item (v, c): factors v QJ_WIDTH … and samples
// c chunk …; rows: one gradient row a chunk. field: F_n at the samples.
kernel void jacobian_squares(global const real* samples, int stride, int chunk,
                             global const real* map, int factors, int loss, real alpha,
                             global const real* field, global real* rows) {
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
    real w = curvature_at(samples, stride, i, loss, field, alpha);
    center_offset d = offset_from(centers, samples, stride, i);
    // Its square is finite too where a sample meets a centre, and d is 0.
    lane inverse = 1 / fmax(d.norm2, lane_of((real)1e-18));
    lane weight = w * inverse * inverse;
    lane logarithm = lane_log2(d.norm2);
    log_sum = fma(w * logarithm, logarithm, log_sum);
    x_sum = fma(weight, d.x * d.x, x_sum);
    y_sum = fma(weight, d.y * d.y, y_sum);
    z_sum = fma(weight, d.z * d.z, z_sum);
    w_sum = fma(weight, d.w * d.w, w_sum);
    scale_sum += w;
  }
  global real* row = rows + (size_t)c * QJ_GRADIENT_COLUMNS(factors);
  real half_log = (real)0.5 * QJ_LN2;
  lane a2 = a * a;
  lane_store(log_sum * (half_log * half_log), row + QJ_MAP_EXPONENT * map_stride, v);
  lane_store(a2 * x_sum, row + QJ_MAP_CENTER_X * map_stride, v);
  lane_store(a2 * y_sum, row + QJ_MAP_CENTER_Y * map_stride, v);
  lane_store(a2 * z_sum, row + QJ_MAP_CENTER_Z * map_stride, v);
  lane_store(a2 * w_sum, row + QJ_MAP_CENTER_W * map_stride, v);
  if (v == 0) row[QJ_GRADIENT_LOG_SCALE(factors)] = scale_sum;
}

// The coarse space's columns of J from the panels of all blocks, which hold `count` factors each at
// most: the log scale, then a block's columns of one component added up. Work-item (s, m): sample s
// of the panels, block m of `blocks`. is_member: for each block, 1 for its factors and 0 for
// padding.
kernel void coarse_panels(int blocks, int count, int chunk, global const real* is_member,
                          global const real* panels, global real* coarse) {
  int s = (int)get_global_id(0), m = (int)get_global_id(1);
  if (s >= chunk) return;
  int component_tiles = QJ_MAP_STRIDE(count) / QJ_PANEL_TILE;
  size_t panel = (size_t)chunk * QJ_PANEL_TILE;
  is_member += m * QJ_MAP_STRIDE(count);
  panels += m * QJ_PANEL_ORDER(count) * (size_t)chunk + s * QJ_PANEL_TILE;
  coarse += s * QJ_PANEL_TILE;
  for (int c = 0; c < QJ_MAP_COMPONENTS; ++c) {
    lane sum = lane_of(0);
    for (int i = 0; i < QJ_MAP_STRIDE(count); i += QJ_WIDTH) {
      int tile = c * component_tiles + i / QJ_PANEL_TILE;
      lane entries = lane_load(panels + tile * panel + i % QJ_PANEL_TILE, 0);
      sum = fma(lane_load(is_member + i, 0), entries, sum);
    }
    int column = 1 + m * QJ_MAP_COMPONENTS + c;
    coarse[column / QJ_PANEL_TILE * panel + column % QJ_PANEL_TILE] = lane_sum(sum);
  }
  if (m > 0) return;
  coarse[0] = panels[QJ_MAP_COMPONENTS * component_tiles * panel];
  for (int j = 1 + blocks * QJ_MAP_COMPONENTS; j < QJ_COARSE_ORDER(blocks); ++j) {
    coarse[j / QJ_PANEL_TILE * panel + j % QJ_PANEL_TILE] = 0;
  }
}

// H = keep H + P^T P over the panels' `chunk` samples, upper triangle by register tiles, for each
// of a row of matrices H, `order` x `order` by rows, and panels P. `keep` is 0 or 1; with 0, H need
// not hold numbers. Work-item (r, c, m): PANEL_ROWS rows and PANEL_VECTORS QJ_WIDTH columns of the
// m-th.
kernel void panel_products(global const real* panels, int chunk, int order, int keep,
                           global real* matrices) {
  int row = (int)get_global_id(0) * PANEL_ROWS;
  int column = (int)get_global_id(1) * PANEL_VECTORS * QJ_WIDTH;
  if (row >= order || column >= order || row >= column + PANEL_VECTORS * QJ_WIDTH) return;
  panels += get_global_id(2) * order * chunk;
  global real* matrix = matrices + get_global_id(2) * order * order;
  size_t panel = (size_t)chunk * QJ_PANEL_TILE;
  global const real* p = panels + row / QJ_PANEL_TILE * panel + row % QJ_PANEL_TILE;
  int second = column + QJ_WIDTH;
  global const real* q0 = panels + column / QJ_PANEL_TILE * panel + column % QJ_PANEL_TILE;
  global const real* q1 = panels + second / QJ_PANEL_TILE * panel + second % QJ_PANEL_TILE;
  lane sum[PANEL_ROWS][PANEL_VECTORS];
#pragma unroll
  for (int r = 0; r < PANEL_ROWS; ++r) sum[r][0] = sum[r][1] = lane_of(0);
  for (int s = 0; s < chunk; ++s) {
    lane b0 = lane_load(q0 + s * QJ_PANEL_TILE, 0);
    lane b1 = lane_load(q1 + s * QJ_PANEL_TILE, 0);
#pragma unroll
    for (int r = 0; r < PANEL_ROWS; ++r) {
      lane a = lane_of(p[s * QJ_PANEL_TILE + r]);
      sum[r][0] = fma(a, b0, sum[r][0]);
      sum[r][1] = fma(a, b1, sum[r][1]);
    }
  }
#pragma unroll
  for (int r = 0; r < PANEL_ROWS; ++r) {
    global real* out = matrix + (size_t)(row + r) * order + column;
    lane h0 = lane_of(0), h1 = lane_of(0);
    if (keep) {
      h0 = lane_load(out, 0);
      h1 = lane_load(out + QJ_WIDTH, 0);
    }
    lane_store(h0 + sum[r][0], out, 0);
    lane_store(h1 + sum[r][1], out + QJ_WIDTH, 0);
  }
}

// As panel_products where work-items share tiles of the panels in local memory: a group of
// PRODUCT_SIDE x PRODUCT_SIDE of them makes PRODUCT_TILE x PRODUCT_TILE entries of H, lanes or not.
// Groups wholly below the diagonal have nothing to do.
#define PRODUCT_SIDE 16
#define PRODUCT_TILE 64
#define PRODUCT_DEPTH 16  // samples in local memory at a time; divides `chunk`
#define PRODUCT_EACH (PRODUCT_TILE / PRODUCT_SIDE)

// Copies columns `first` … of the panels' samples s … into local memory; 0 past the order.
static inline void load_panel_tile(global const real* panels, int chunk, int order, int first,
                                   int s, local real* tile) {
  int member = (int)(get_local_id(1) * PRODUCT_SIDE + get_local_id(0));
  for (int e = member; e < PRODUCT_DEPTH * PRODUCT_TILE; e += PRODUCT_SIDE * PRODUCT_SIDE) {
    int column = first + e % PRODUCT_TILE;
    size_t at = ((size_t)(column / QJ_PANEL_TILE) * chunk + s + e / PRODUCT_TILE) * QJ_PANEL_TILE +
                column % QJ_PANEL_TILE;
    tile[e] = column < order ? panels[at] : 0;
  }
}

kernel void panel_products_shared(global const real* panels, int chunk, int order, int keep,
                                  global real* matrices) {
  local real rows[PRODUCT_DEPTH * PRODUCT_TILE], columns[PRODUCT_DEPTH * PRODUCT_TILE];
  int x = (int)get_local_id(0), y = (int)get_local_id(1);
  int first_column = (int)get_group_id(0) * PRODUCT_TILE;
  int first_row = (int)get_group_id(1) * PRODUCT_TILE;
  if (first_row > first_column) return;
  panels += get_global_id(2) * order * chunk;
  global real* matrix = matrices + get_global_id(2) * order * order;
  real sum[PRODUCT_EACH][PRODUCT_EACH];
#pragma unroll
  for (int i = 0; i < PRODUCT_EACH; ++i) {
#pragma unroll
    for (int j = 0; j < PRODUCT_EACH; ++j) sum[i][j] = 0;
  }
  for (int s = 0; s < chunk; s += PRODUCT_DEPTH) {
    load_panel_tile(panels, chunk, order, first_row, s, rows);
    load_panel_tile(panels, chunk, order, first_column, s, columns);
    barrier(CLK_LOCAL_MEM_FENCE);
    for (int d = 0; d < PRODUCT_DEPTH; ++d) {
#pragma unroll
      for (int i = 0; i < PRODUCT_EACH; ++i) {
        real a = rows[d * PRODUCT_TILE + i * PRODUCT_SIDE + y];
#pragma unroll
        for (int j = 0; j < PRODUCT_EACH; ++j) {
          sum[i][j] = fma(a, columns[d * PRODUCT_TILE + j * PRODUCT_SIDE + x], sum[i][j]);
        }
      }
    }
    barrier(CLK_LOCAL_MEM_FENCE);
  }
#pragma unroll
  for (int i = 0; i < PRODUCT_EACH; ++i) {
    int row = first_row + i * PRODUCT_SIDE + y;
#pragma unroll
    for (int j = 0; j < PRODUCT_EACH; ++j) {
      int column = first_column + j * PRODUCT_SIDE + x;
      if (row < order && column < order) {
        global real* out = matrix + (size_t)row * order + column;
        *out = (keep ? *out : 0) + sum[i][j];
      }
    }
  }
}
