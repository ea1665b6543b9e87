// What a map makes of given points besides the field: versors, images, how long orbits are, and the
// way back of a gradient through one iterate. points: arrays X, Y, Z, W and what a kernel says, of
// `stride` reals each (a multiple of QJ_WIDTH); one work-item per QJ_WIDTH points, `groups` of
// them.

#include "map.clh"

// The k-th four of the arrays.
static inline qlane query_at(global const real* points, int stride, int g, int k) {
  return q_load(points + (size_t)4 * k * stride, stride, g);
}

// U. versors: four arrays.
kernel void versors_at_points(global const real* points, int stride, int groups,
                              global const real* map, int factors, global real* versors) {
  int g = (int)get_global_id(0);
  if (g >= groups) return;
  q_store(map_unit_image(q_load(points, stride, g), map, factors), versors, stride, g);
}

// R and F as map_iterate has them. images: five arrays, F last. R is no longer than e^40.
kernel void images_at_points(global const real* points, int stride, int groups,
                             global const real* map, int factors, global real* images) {
  int g = (int)get_global_id(0);
  if (g >= groups) return;
  qlane q = q_load(points, stride, g);
  lane f = map_modulus(q, map, factors);
  q_store(map_image(q, f, map, factors), images, stride, g);
  lane_store(f, images + (size_t)4 * stride, g);
}

// Iterates that map_iterate executes. counts: one array.
kernel void escape_counts_at_points(global const real* points, int stride, int groups,
                                    global const real* map, int factors, int iterations,
                                    global real* counts) {
  int g = (int)get_global_id(0);
  if (g >= groups) return;
  ilane executed;
  map_iterate(q_load(points, stride, g), map, factors, iterations, false, &executed);
  lane_store(to_lane(executed), counts, g);
}

// The cotangent of q over |R(q)|, from that of R(q). points: q, U and the cotangent of R(q).
// cotangents: four arrays.
kernel void pull_back_at_points(global const real* points, int stride, int groups,
                                global const real* map, int factors, global real* cotangents) {
  int g = (int)get_global_id(0);
  if (g >= groups) return;
  qlane u = query_at(points, stride, g, 1), r_bar = query_at(points, stride, g, 2);
  // dR = |R| (U dF + dU).
  qlane q_bar = map_pull_back(q_load(points, stride, g), u, q_dot(u, r_bar), r_bar, map, factors);
  q_store(q_bar, cotangents, stride, g);
}
