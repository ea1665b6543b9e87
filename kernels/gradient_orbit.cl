// Gradient of the energy for n iterates, by reverse mode over the iterates of each sample
// (docs/maths.md, "Gradient"). Memory per sample does not depend on the number of factors: unit
// versors are undone by their conjugates, so prefix and suffix products are walked, not stored.

#include "map_step.clh"
#include "qjulia/shared/gradient_layout.h"
#include "qjulia/shared/loss.h"

#ifndef QJ_ITERATIONS
#define QJ_ITERATIONS QJ_MOST_ITERATIONS  // n, set by the build
#endif

// An orbit as the forward pass leaves it.
typedef struct {
  qlane point[QJ_ITERATIONS];    // q_j
  qlane versor[QJ_ITERATIONS];   // U_j
  lane log_norm[QJ_ITERATIONS];  // F_j
  ilane executed;                // iterates per lane
  int longest;                   // the most of any lane
} orbit;

inline void run_orbit(qlane q, global const real* map, int factors, orbit* o) {
  lane escape = lane_of(map[QJ_MAP_LOG_ESCAPE]);
  ilane live = isless(map_log_radius(q), escape);
  o->executed = (ilane)0;
  int i = 0;
  for (; i < QJ_ITERATIONS && lane_any(live); ++i) {
    o->point[i] = q;
    o->log_norm[i] = map_step(q, map, factors, &o->versor[i]);
    o->executed += ilane_where(live, (ilane)1, (ilane)0);
    q = q_where(live, q_scale(lane_exp(fmin(o->log_norm[i], lane_of((real)40))), o->versor[i]), q);
    live &= isless(o->log_norm[i], escape);
  }
  o->longest = i;
}

// Adds one iterate's share to the lane sums (component arrays over factors, as the map's) and
// returns the cotangent of its point q. f_bar: cotangent of F; u_bar: of the unit versor u.
inline qlane pull_back(qlane q, qlane u, lane f_bar, qlane u_bar, global const real* map,
                       int factors, global lane* sums) {
  int stride = QJ_MAP_STRIDE(factors);
  global const real* components = map + QJ_MAP_HEADER;
  qlane q_bar = q_make(lane_of(0), lane_of(0), lane_of(0), lane_of(0));
  qlane prefix = u, stripped = u_bar;
  for (int k = factors - 1; k >= 0; --k) {
    real a = components[QJ_MAP_EXPONENT * stride + k];
    factor_polar f = map_factor(
        q, a, components[QJ_MAP_CENTER_X * stride + k], components[QJ_MAP_CENTER_Y * stride + k],
        components[QJ_MAP_CENTER_Z * stride + k], components[QJ_MAP_CENTER_W * stride + k]);
    prefix = q_mul_conj(prefix, f.versor);
    qlane m = q_conj_mul(prefix, stripped);  // cotangent of the k-th versor
    stripped = q_mul_conj(stripped, f.versor);
    lane hy = f.d.y * f.inv_rho, hz = f.d.z * f.inv_rho, hw = f.d.w * f.inv_rho;
    lane hm = fma(hy, m.y, fma(hz, m.z, hw * m.w));
    lane phi = f.cosine * hm - f.sine * m.x;  // cotangent of a t
    lane inv_norm2 = lane_of(1) / f.norm2;
    lane radial = f_bar * a * inv_norm2;
    lane turning = phi * a * inv_norm2;
    lane across = f.sine * f.inv_rho;
    lane along = turning * f.d.x - across * hm;
    qlane d_bar = q_make(fma(radial, f.d.x, -turning * f.rho),
                         fma(radial, f.d.y, fma(along, hy, across * m.y)),
                         fma(radial, f.d.z, fma(along, hz, across * m.z)),
                         fma(radial, f.d.w, fma(along, hw, across * m.w)));
    q_bar = q_add(q_bar, d_bar);
    lane log_norm = lane_log2(f.norm2) * ((real)0.5 * QJ_LN2);
    sums[QJ_MAP_EXPONENT * stride + k] += fma(f_bar, log_norm, phi * f.angle);
    sums[QJ_MAP_CENTER_X * stride + k] -= d_bar.x;
    sums[QJ_MAP_CENTER_Y * stride + k] -= d_bar.y;
    sums[QJ_MAP_CENTER_Z * stride + k] -= d_bar.z;
    sums[QJ_MAP_CENTER_W * stride + k] -= d_bar.w;
  }
  return q_bar;
}

// samples, stride, cotangent: as energy_terms leaves them. One work-item per `vectors` vectors of
// samples, `items` of them. lane_sums: 5 QJ_MAP_STRIDE(factors) lanes an item, its own to add in.
// rows: one gradient row an item.
kernel void gradient_orbit(global const real* samples, int stride, int vectors, int items,
                           global const real* map, int factors, global const real* cotangent,
                           global real* lane_sums, global real* rows) {
  int item = (int)get_global_id(0);
  if (item >= items) return;
  int columns = QJ_GRADIENT_LOG_SCALE(factors);
  global lane* sums = (global lane*)lane_sums + (size_t)item * columns;
  for (int i = 0; i < columns; ++i) sums[i] = lane_of(0);
  lane scale_sum = lane_of(0);
  int end = min((item + 1) * vectors, stride / QJ_WIDTH);
  for (int i = item * vectors; i < end; ++i) {
    qlane q = q_make(lane_load(samples + QJ_SAMPLE_X * stride, i),
                     lane_load(samples + QJ_SAMPLE_Y * stride, i),
                     lane_load(samples + QJ_SAMPLE_Z * stride, i), lane_of(map[QJ_MAP_SLICE]));
    orbit o;
    run_orbit(q, map, factors, &o);
    lane dedf = lane_load(cotangent, i);
    qlane zero = q_make(lane_of(0), lane_of(0), lane_of(0), lane_of(0));
    qlane q_bar = zero;  // cotangent of q_{j+1}
    for (int j = o.longest - 1; j >= 0; --j) {
      ilane last = o.executed == (ilane)(j + 1);
      ilane passed = o.executed > (ilane)(j + 1);
      lane norm = lane_exp(fmin(o.log_norm[j], lane_of((real)40)));
      qlane u_bar = q_where(passed, q_scale(norm, q_bar), zero);
      lane f_bar = lane_where(last, dedf, q_dot(u_bar, o.versor[j]));
      scale_sum += f_bar;
      q_bar = pull_back(o.point[j], o.versor[j], f_bar, u_bar, map, factors, sums);
    }
  }
  global real* row = rows + (size_t)item * QJ_GRADIENT_COLUMNS(factors);
  for (int i = 0; i < columns; ++i) row[i] = lane_sum(sums[i]);
  row[columns] = lane_sum(scale_sum);
}
