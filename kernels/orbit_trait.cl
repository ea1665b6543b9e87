// What colours a point of the set by its orbit.

#include "map.clh"

// For each point, 0 ... 1: with `trap` 0 how late its orbit is decided, (m - 1) / (n - 1) for the
// m-th of n iterates; else how close its first two iterates come to the plane X = 0, the least
// |X| / |q| of those up to the one that decides: later ones differ from point to point. points:
// three arrays X, Y, Z of `stride` reals, a multiple of QJ_WIDTH. trait: `stride` reals.
kernel void orbit_trait(global const real* points, int stride, int groups, global const real* map,
                        int factors, int iterations, int trap, global real* trait) {
  int g = (int)get_global_id(0);
  if (g >= groups) return;
  real above = fmin(map[QJ_MAP_LOG_ESCAPE], map[QJ_MAP_LOG_OUTER]);
  real below = map[QJ_MAP_LOG_INNER];
  qlane q = q_make(lane_load(points, g), lane_load(points + stride, g),
                   lane_load(points + 2 * stride, g), lane_of(map[QJ_MAP_SLICE]));
  ilane live = isless(map_log_radius(q), lane_of(map[QJ_MAP_LOG_ESCAPE]));
  lane later = lane_of(0), closest = lane_of(1);
  for (int i = 0; i < iterations && lane_any(live); ++i) {
    lane next = map_modulus(q, map, factors);
    if (i > 0) later += lane_where(live, lane_of(1), lane_of(0));
    q = q_where(live, map_image(q, next, map, factors), q);
    lane angle = fabs(q.x) * lane_rsqrt(fmax(q_dot(q, q), lane_of(QJ_TINY)));
    if (i < 2) closest = lane_where(live, lane_min(closest, angle), closest);
    live &= isless(next, lane_of(above)) & isgreater(next, lane_of(below));
  }
  lane_store(trap ? closest : later / (real)max(iterations - 1, 1), trait, g);
}
