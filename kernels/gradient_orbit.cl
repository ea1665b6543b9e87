// Energy and gradient for n iterates, by reverse mode over the iterates of each sample
// (docs/theory/maps.md, "Gradient"). Memory per sample does not depend on the number of factors:
// unit versors are undone by their conjugates, so prefix and suffix products are walked, not
// stored. F is that of the map's kind: what is fitted is not steeper outside.

#include "factor_sums.clh"
#include "loss.clh"
#include "map.clh"

// What a work-item keeps of an orbit for the way back: U_j and F_j of all iterates but the n-th, in
// global memory, the work-items of a group side by side. Private arrays would grow with n.
static inline void orbit_keep(global lane* kept, int j, qlane versor, lane log_norm) {
  global lane* at = kept + (size_t)j * QJ_ORBIT_LANES * QJ_GROUP;
  uint member = SUMS_MEMBER;
  at[member] = versor.x;
  at[member + QJ_GROUP] = versor.y;
  at[member + 2 * QJ_GROUP] = versor.z;
  at[member + 3 * QJ_GROUP] = versor.w;
  at[member + 4 * QJ_GROUP] = log_norm;
}

// |q_{j+1}| and U_j.
static inline lane orbit_kept(global const lane* kept, int j, qlane* versor) {
  global const lane* at = kept + (size_t)j * QJ_ORBIT_LANES * QJ_GROUP;
  uint member = SUMS_MEMBER;
  *versor = q_make(at[member], at[member + QJ_GROUP], at[member + 2 * QJ_GROUP],
                   at[member + 3 * QJ_GROUP]);
  return lane_exp(lane_min(at[member + 4 * QJ_GROUP], lane_of((real)40)));
}

// An orbit's end. One that has escaped keeps its last point inside.
typedef struct {
  lane last;       // F of the last executed iterate, ln |q| where there is none
  ilane executed;  // iterates per lane
  int longest;     // the most of any lane
} orbit;

static inline orbit run_orbit(qlane q, global const real* map, int factors, int n,
                              global lane* kept) {
  lane escape = lane_of(map[QJ_MAP_LOG_ESCAPE]);
  orbit o;
  o.last = map_log_radius(q);
  ilane live = isless(o.last, escape);
  o.executed = (ilane)0;
  int i = 0;
  for (; i < n && lane_any(live); ++i) {
    lane next;
    if (i + 1 < n) {
      qlane versor;
      next = kind_step(q, map, factors, &versor);
      orbit_keep(kept, i, versor, next);
      lane norm = lane_exp(lane_min(next, lane_of((real)40)));
      q = q_where(live & isless(next, escape), q_scale(norm, versor), q);
    } else {
      next = kind_modulus(q, map, factors);
    }
    o.last = lane_where(live, next, o.last);
    o.executed += ilane_where(live, (ilane)1, (ilane)0);
    live &= isless(next, escape);
  }
  o.longest = i;
  return o;
}

// Adds one iterate's share to the sums and returns the cotangent of its point q. f_bar: cotangent
// of F; u_bar: of the unit versor u.
factor_loop qlane pull_back(qlane q, qlane u, lane f_bar, qlane u_bar, global const real* map,
                            int factors, factor_sums sums) {
  int stride = QJ_MAP_STRIDE(factors);
  int tile = sums_tile(factors);
  global const real* components = map + QJ_MAP_HEADER;
  qlane q_bar = q_make(lane_of(0), lane_of(0), lane_of(0), lane_of(0));
  qlane t = q_conj_mul(u, u_bar);
  int first = factors - 1 - (factors - 1) % tile;
  factor_walk walk = walk_from(q, map, factors, factors - 1, max(factors - 2, 0));
  for (int k = factors - 1; k >= 0; --k) {
    real a = components[QJ_MAP_EXPONENT * stride + k];
    factor_polar f = walk_take(&walk, k, max(k - 2, 0));
    lane phi;
    qlane d_bar = factor_pull_back(f, a, f_bar, &t, &phi);
    q_bar = q_add(q_bar, d_bar);
    lane log_norm = lane_log2(f.offset.norm2) * ((real)0.5 * QJ_LN2);
    sums_add(sums, QJ_MAP_EXPONENT, k, fma(f_bar, log_norm, phi * f.angle));
    sums_add(sums, QJ_MAP_CENTER_X, k, -d_bar.x);
    sums_add(sums, QJ_MAP_CENTER_Y, k, -d_bar.y);
    sums_add(sums, QJ_MAP_CENTER_Z, k, -d_bar.z);
    sums_add(sums, QJ_MAP_CENTER_W, k, -d_bar.w);
    if (k == first) {
      sums_close(sums, first, min(tile, factors - first));
      first -= tile;
    }
  }
  return q_bar;
}

// Pulls back where no lane has an iterate after this one: F alone matters, and no versor.
factor_loop qlane pull_back_last(qlane q, lane f_bar, global const real* map, int factors,
                                 factor_sums sums) {
  int stride = QJ_MAP_STRIDE(factors);
  int tile = sums_tile(factors);
  global const real* components = map + QJ_MAP_HEADER;
  qlane q_bar = q_make(lane_of(0), lane_of(0), lane_of(0), lane_of(0));
  int first = 0;
  for (int k = 0; k < factors; ++k) {
    real a = components[QJ_MAP_EXPONENT * stride + k];
    qlane d = q_make(q.x - components[QJ_MAP_CENTER_X * stride + k],
                     q.y - components[QJ_MAP_CENTER_Y * stride + k],
                     q.z - components[QJ_MAP_CENTER_Z * stride + k],
                     q.w - components[QJ_MAP_CENTER_W * stride + k]);
    lane norm2 = q_dot(d, d) + QJ_TINY;
    lane radial = f_bar * a / norm2;
    qlane d_bar = q_scale(radial, d);
    q_bar = q_add(q_bar, d_bar);
    sums_add(sums, QJ_MAP_EXPONENT, k, f_bar * (lane_log2(norm2) * ((real)0.5 * QJ_LN2)));
    sums_add(sums, QJ_MAP_CENTER_X, k, -d_bar.x);
    sums_add(sums, QJ_MAP_CENTER_Y, k, -d_bar.y);
    sums_add(sums, QJ_MAP_CENTER_Z, k, -d_bar.z);
    sums_add(sums, QJ_MAP_CENTER_W, k, -d_bar.w);
    if (k + 1 == min(first + tile, factors)) {
      sums_close(sums, first, k + 1 - first);
      first += tile;
    }
  }
  return q_bar;
}

static inline qlane sample_point(global const real* samples, int stride, uint i,
                                 global const real* map) {
  return q_make(lane_load(samples + QJ_SAMPLE_X * stride, i),
                lane_load(samples + QJ_SAMPLE_Y * stride, i),
                lane_load(samples + QJ_SAMPLE_Z * stride, i),
                lane_load(samples + QJ_SAMPLE_W * stride, i) + map[QJ_MAP_SLICE]);
}

// samples, map and the scalars: as energy_terms takes them, but a group of QJ_GROUP work-items
// (factor_sums.clh) takes `vectors` vectors of samples an item, side by side; `items` counts
// groups. orbits: (iterations - 1) QJ_ORBIT_LANES lanes a work-item. lane_sums: 5
// QJ_MAP_STRIDE(factors) lanes a group to add in, where QJ_GROUP is 1. energies: one real a group.
// rows: one gradient row a group.
SUMS_KERNEL kernel void gradient_orbit(qj_energy_arguments with,
                                       global const real* restrict samples,
                                       global const real* restrict map,
                                       global real* restrict orbits,
                                       global real* restrict lane_sums,
                                       global real* restrict energies, global real* restrict rows) {
  int group = SUMS_GROUP, member = SUMS_MEMBER;
  if (group >= with.items) return;
  int stride = with.stride, factors = with.factors, n = with.iterations;
  global lane* kept =
      (global lane*)orbits + (size_t)group * (size_t)(n - 1) * QJ_ORBIT_LANES * QJ_GROUP;
  int columns = QJ_GRADIENT_LOG_SCALE(factors);
  global real* row = rows + (size_t)group * QJ_GRADIENT_COLUMNS(factors);
#if QJ_GROUP == 1
  factor_sums sums = {(global lane*)lane_sums + (size_t)group * columns, QJ_MAP_STRIDE(factors)};
  for (int i = 0; i < columns; ++i) sums.sums[i] = lane_of(0);
#else
  local lane shares[SUMS_COLUMNS * SUMS_PITCH];
  local int group_longest;
  factor_sums sums = {shares, row, QJ_MAP_STRIDE(factors)};
  (void)lane_sums;
  for (int i = member; i < columns; i += QJ_GROUP) row[i] = 0;
  barrier(CLK_LOCAL_MEM_FENCE | CLK_GLOBAL_MEM_FENCE);
#endif
  lane energy = lane_of(0), scale_sum = lane_of(0);
  int all = stride / QJ_WIDTH;
  int left = (all - group * with.vectors * QJ_GROUP + QJ_GROUP - 1) / QJ_GROUP;
  for (int v = 0; v < min(with.vectors, left); ++v) {
    // The group's vectors of samples, and of them this work-item's: an offset that is the same for
    // all and a small one of its own take fewer registers than an address. Work-items past the end
    // keep step with their group.
    int begin = (group * with.vectors + v) * QJ_GROUP;
    global const real* some = samples + (size_t)begin * QJ_WIDTH;
    uint i = min((uint)member, (uint)(all - 1 - begin));
    bool is_one = i == (uint)member;
    orbit o = run_orbit(sample_point(some, stride, i, map), map, factors, n, kept);
    lane weight = is_one ? lane_load(some + QJ_SAMPLE_WEIGHT * stride, i) : lane_of(0);
    lane dedf;
    energy += loss_term(with.loss, o.last, weight, lane_load(some + QJ_SAMPLE_TARGET * stride, i),
                        lane_load(some + QJ_SAMPLE_SIDE * stride, i), with.alpha, &dedf);
    int longest = lane_any(isnotequal(dedf, lane_of(0))) ? o.longest : 0;
#if QJ_GROUP > 1
    if (member == 0) group_longest = 0;
    barrier(CLK_LOCAL_MEM_FENCE);
    atomic_max(&group_longest, longest);
    barrier(CLK_LOCAL_MEM_FENCE);
    longest = group_longest;
#endif
    qlane zero = q_make(lane_of(0), lane_of(0), lane_of(0), lane_of(0));
    qlane q_bar = zero;  // cotangent of q_{j+1}
    for (int j = longest - 1; j >= 0; --j) {
      ilane last = o.executed == (ilane)(j + 1);
      ilane passed = o.executed > (ilane)(j + 1);
      // Lanes without this iterate take part with no share, from the origin.
      qlane q;
      if (j > 0) {
        qlane u;
        lane norm = orbit_kept(kept, j - 1, &u);
        q = q_where(last | passed, q_scale(norm, u), zero);
      } else {
        q = sample_point(some, stride, i, map);
      }
      if (j + 1 < longest) {
        qlane u;
        lane norm = orbit_kept(kept, j, &u);
        u = q_where(passed, u, q_make(lane_of(1), lane_of(0), lane_of(0), lane_of(0)));
        qlane u_bar = q_where(passed, q_scale(norm, q_bar), zero);
        lane f_bar = lane_where(last, dedf, q_dot(u_bar, u));
        scale_sum += f_bar;
        q_bar = pull_back(q, u, f_bar, u_bar, map, factors, sums);
      } else {
        lane f_bar = lane_where(last, dedf, lane_of(0));
        scale_sum += f_bar;
        q_bar = pull_back_last(q, f_bar, map, factors, sums);
      }
    }
  }
#if QJ_GROUP == 1
  energies[group] = lane_sum(energy);
  for (int i = 0; i < columns; ++i) row[i] = lane_sum(sums.sums[i]);
  row[columns] = lane_sum(scale_sum);
#else
  shares[member] = energy;
  shares[SUMS_PITCH + member] = scale_sum;
  barrier(CLK_LOCAL_MEM_FENCE);
  if (member == 0) {
    lane sum = lane_of(0), scale = lane_of(0);
    for (int i = 0; i < QJ_GROUP; ++i) {
      sum += shares[i];
      scale += shares[SUMS_PITCH + i];
    }
    energies[group] = lane_sum(sum);
    row[columns] = lane_sum(scale);
  }
#endif
}
