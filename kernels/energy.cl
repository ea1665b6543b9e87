// Energy over samples: F_n at each, its term of the energy, and the cotangent the gradient needs.

#include "loss.clh"
#include "map.clh"

// samples: QJ_SAMPLE_ARRAYS arrays of `stride` reals (a multiple of QJ_WIDTH; padding has weight
// 0). One work-item per `vectors` vectors of QJ_WIDTH samples, `items` of them.
// field, cotangent: `stride` reals. energies: one real an item.
kernel void energy_terms(qj_energy_arguments with, global const real* restrict samples,
                         global const real* restrict map, global real* restrict field,
                         global real* restrict cotangent, global real* restrict energies) {
  int item = (int)get_global_id(0);
  if (item >= with.items) return;
  int stride = with.stride;
  lane energy = lane_of(0);
  int end = min((item + 1) * with.vectors, stride / QJ_WIDTH);
  for (int i = item * with.vectors; i < end; ++i) {
    qlane q = q_load(samples + QJ_SAMPLE_X * stride, stride, i);
    q.w += map[QJ_MAP_SLICE];
    ilane executed;
    lane f = map_iterate(q, map, with.factors, with.iterations, false, &executed);
    lane dedf;
    energy += loss_term(with.loss, f, lane_load(samples + QJ_SAMPLE_WEIGHT * stride, i),
                        lane_load(samples + QJ_SAMPLE_TARGET * stride, i),
                        lane_load(samples + QJ_SAMPLE_SIDE * stride, i), with.alpha, &dedf);
    lane_store(f, field, i);
    // Where no iterate ran, F does not depend on the map.
    lane_store(lane_where(executed > 0, dedf, lane_of(0)), cotangent, i);
  }
  energies[item] = lane_sum(energy);
}
