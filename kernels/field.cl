// The field F_n at given points, and the gradient of F_1.

#include "map.clh"

// points: four arrays X, Y, Z, W of `stride` reals each (a multiple of QJ_WIDTH); one work-item
// per QJ_WIDTH points, `groups` of them. field: `stride` reals.
kernel void field_at_points(global const real* points, int stride, int groups,
                            global const real* map, int factors, int iterations, int decided,
                            global real* field) {
  int g = (int)get_global_id(0);
  if (g >= groups) return;
  qlane q = q_load(points, stride, g);
  lane f = map_iterate(q, map, factors, iterations, decided != 0, 0);
  lane_store(f, field, g);
}

// Gradient of F_1 by the point. gradient: four arrays of `stride` reals.
kernel void field_gradient_at_points(global const real* points, int stride, int groups,
                                     global const real* map, int factors, global real* gradient) {
  int g = (int)get_global_id(0);
  if (g >= groups) return;
  qlane q = q_load(points, stride, g);
  q_store(map_modulus_gradient(q, map, factors), gradient, stride, g);
}
