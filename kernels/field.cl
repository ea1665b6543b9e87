// The field F_n at given points, and the gradient of F_1.

#include "map_step.clh"

// points: four arrays X, Y, Z, W of `stride` reals each (a multiple of QJ_WIDTH); one work-item
// per QJ_WIDTH points, `groups` of them. field: `stride` reals.
kernel void field_at_points(global const real* points, int stride, int groups,
                            global const real* map, int factors, int iterations, int decided,
                            global real* field) {
  int g = (int)get_global_id(0);
  if (g >= groups) return;
  qlane q = q_make(lane_load(points, g), lane_load(points + stride, g),
                   lane_load(points + 2 * stride, g), lane_load(points + 3 * stride, g));
  lane f = map_iterate(q, map, factors, iterations, decided != 0, 0);
  lane_store(f, field, g);
}

// Gradient of F_1 by the point: sum_k a_k d_k / |d_k|^2. gradient: four arrays of `stride` reals.
kernel void field_gradient_at_points(global const real* points, int stride, int groups,
                                     global const real* map, int factors, global real* gradient) {
  int g = (int)get_global_id(0);
  if (g >= groups) return;
  qlane q = q_make(lane_load(points, g), lane_load(points + stride, g),
                   lane_load(points + 2 * stride, g), lane_load(points + 3 * stride, g));
  if (map[QJ_MAP_KIND] != 0) {
    // With g = q^2 + c, q = (A, v), g = (g0, u): (A g0 + v.u, A u - g0 v) 2 / |g|^2.
    qlane h = map_square(q, map);
    lane s = (real)2 / fmax(q_dot(h, h), lane_of(QJ_TINY));
    lane_store(s * q_dot(q, h), gradient, g);
    lane_store(s * (q.x * h.y - h.x * q.y), gradient + stride, g);
    lane_store(s * (q.x * h.z - h.x * q.z), gradient + 2 * stride, g);
    lane_store(s * (q.x * h.w - h.x * q.w), gradient + 3 * stride, g);
    return;
  }
  global const real* a = MAP_COMPONENT(map, factors, QJ_MAP_EXPONENT);
  global const real* cx = MAP_COMPONENT(map, factors, QJ_MAP_CENTER_X);
  global const real* cy = MAP_COMPONENT(map, factors, QJ_MAP_CENTER_Y);
  global const real* cz = MAP_COMPONENT(map, factors, QJ_MAP_CENTER_Z);
  global const real* cw = MAP_COMPONENT(map, factors, QJ_MAP_CENTER_W);
  qlane sum = q_make(lane_of(0), lane_of(0), lane_of(0), lane_of(0));
  for (int k = 0; k < factors; ++k) {
    qlane d = q_make(q.x - cx[k], q.y - cy[k], q.z - cz[k], q.w - cw[k]);
    lane s = a[k] / fmax(q_dot(d, d), lane_of(QJ_TINY));
    sum = q_add(sum, q_scale(s, d));
  }
  lane_store(sum.x, gradient, g);
  lane_store(sum.y, gradient + stride, g);
  lane_store(sum.z, gradient + 2 * stride, g);
  lane_store(sum.w, gradient + 3 * stride, g);
}
