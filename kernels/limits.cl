// What a device can do at most: kernels that do one thing only, for `qjulia profile`.

#include "lanes.clh"

// `rounds` rounds of QJ_CHAINS independent chains of fused multiply-adds a lane: enough of them to
// hide the latency of one.
#define QJ_CHAINS 16
kernel void fma_chains(global const real* seed, int rounds, global real* out) {
  int i = (int)get_global_id(0);
  lane factor = lane_of(seed[0]), term = lane_of(seed[1]);
  lane chain[QJ_CHAINS];
#pragma unroll
  for (int c = 0; c < QJ_CHAINS; ++c) chain[c] = lane_of((real)(i + c));
  for (int r = 0; r < rounds; ++r) {
#pragma unroll
    for (int c = 0; c < QJ_CHAINS; ++c) chain[c] = fma(chain[c], factor, term);
  }
  lane sum = lane_of(0);
#pragma unroll
  for (int c = 0; c < QJ_CHAINS; ++c) sum += chain[c];
  out[i] = lane_sum(sum);
}

// One work-item per `vectors` vectors of QJ_WIDTH reals.
kernel void copy_reals(global const real* from, int vectors, int items, global real* to) {
  int item = (int)get_global_id(0);
  if (item >= items) return;
  for (int i = 0; i < vectors; ++i) {
    lane_store(lane_load(from, item * vectors + i), to, item * vectors + i);
  }
}

// Each work-item reads its own `vectors` vectors, a multiple of QJ_READS, `rounds` times over: they
// stay in the nearest cache that holds them. Enough sums to hide the latency of a multiply-add.
#define QJ_READS 12
kernel void read_reals(global const real* from, int vectors, int rounds, global real* out) {
  int item = (int)get_global_id(0);
  lane factor = lane_of((real)0.5), sums[QJ_READS];
#pragma unroll
  for (int c = 0; c < QJ_READS; ++c) sums[c] = lane_of(0);
  for (int r = 0; r < rounds; ++r) {
    for (int i = 0; i < vectors; i += QJ_READS) {
#pragma unroll
      for (int c = 0; c < QJ_READS; ++c) {
        sums[c] = fma(sums[c], factor, lane_load(from, item * vectors + i + c));
      }
    }
  }
  lane sum = lane_of(0);
#pragma unroll
  for (int c = 0; c < QJ_READS; ++c) sum += sums[c];
  out[item] = lane_sum(sum);
}

kernel void no_work(global real* out) {
  if (get_global_id(0) == 0) out[0] = 0;
}
