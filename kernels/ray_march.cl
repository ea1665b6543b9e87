// First hits of rays with the iterated set {F_n < L}.
//
// Where F_1 >= ln r_out the next iterate escapes for certain, so F_1 alone (a potential, cheap)
// tells that a point is outside, and how far the undecided band {F_1 < ln r_out} is at least:
// (F_1 - ln r_out) / max |grad F_1|. In the band, orbits are run. An orbit that escapes with its
// m-th iterate tells a distance too: each iterate stretches by about |grad F_1|, so that it is
// about (F_m - ln r_out) / |grad F_1|^m.

#include "map_step.clh"
#include "view.clh"

inline qlane point_on(lane_ray r, lane t, real slice) {
  return q_make(fma(t, r.dx, r.ox), fma(t, r.dy, r.oy), fma(t, r.dz, r.oz), lane_of(slice));
}

// F_1, and the squared distance to the nearest factor: near a pole outside the shape F_1 is high
// without the band being far.
inline lane log_norm_and_nearest(qlane q, global const real* map, int factors, lane* nearest2) {
  global const real* a = MAP_COMPONENT(map, factors, QJ_MAP_EXPONENT);
  global const real* cx = MAP_COMPONENT(map, factors, QJ_MAP_CENTER_X);
  global const real* cy = MAP_COMPONENT(map, factors, QJ_MAP_CENTER_Y);
  global const real* cz = MAP_COMPONENT(map, factors, QJ_MAP_CENTER_Z);
  global const real* cw = MAP_COMPONENT(map, factors, QJ_MAP_CENTER_W);
  lane sum = lane_of(0), least = lane_of((real)1e30f);
  for (int k = 0; k < factors; ++k) {
    lane dx = q.x - cx[k], dy = q.y - cy[k], dz = q.z - cz[k], dw = q.w - cw[k];
    lane n = fma(dx, dx, fma(dy, dy, fma(dz, dz, fma(dw, dw, lane_of(QJ_TINY)))));
    sum = fma(lane_of(a[k]), lane_log2(n), sum);
    least = fmin(least, n);
  }
  *nearest2 = least;
  return fma(sum, lane_of((real)0.5 * QJ_LN2), lane_of(map[QJ_MAP_LOG_SCALE]));
}

// Depths along rays of a view. rays: three arrays of `stride` reals (a multiple of QJ_WIDTH), the
// pixel coordinates x and y of each ray and a hint: a depth close before its hit, or 0. Neighbours
// in the list should be neighbours in the picture, so that lanes do alike. radius: of a ball about
// the origin that holds the set. steepest: greatest |grad F_1| about the band. shortest: the least
// step. Hits are bisected to `tolerance`. One work-item per QJ_WIDTH rays, `groups` of them.
kernel void march_depth(global const real* map, int factors, int iterations,
                        global const real* view, global const real* rays, int stride, int groups,
                        real radius, real steepest, real shortest, real tolerance,
                        global real* depth) {
  int g = (int)get_global_id(0);
  if (g >= groups) return;
  real slice = map[QJ_MAP_SLICE];
  real level = map[QJ_MAP_SURFACE_LEVEL];
  // One iterate decides every point by itself.
  real far_level = iterations == 1 ? level : fmin(map[QJ_MAP_LOG_ESCAPE], map[QJ_MAP_LOG_OUTER]);

  real log_shell = -log(steepest);

  lane_ray ray = view_ray(view, lane_load(rays, g), lane_load(rays + stride, g));
  // The part of the ray inside the ball.
  lane middle = -fma(ray.ox, ray.dx, fma(ray.oy, ray.dy, ray.oz * ray.dz));
  lane o2 = fma(ray.ox, ray.ox, fma(ray.oy, ray.oy, ray.oz * ray.oz));
  lane half2 = fma(middle, middle, radius * radius - o2);
  lane half_chord = sqrt(fmax(half2, lane_of(0)));
  lane t = fmax(middle - half_chord, lane_of(0));
  lane end = middle + half_chord;

  ilane live = isgreater(half2, lane_of(0)) & isless(t, end);
  lane start = t;
  t = fmax(lane_load(rays + 2 * stride, g), start);
  // The last depth known to be outside; below `start` where none is known.
  lane outside = lane_where(isgreater(t, start), lane_of(-1), start);
  lane back = lane_of(4 * shortest);
  ilane hit = (ilane)0;
  while (lane_any(live)) {
    // Approach until every live lane is in the band.
    ilane far = live;
    while (lane_any(far)) {
      lane nearest2;
      lane above =
          log_norm_and_nearest(point_on(ray, t, slice), map, factors, &nearest2) - far_level;
      far &= isgreater(above, lane_of(0));
      lane step = fmax(fmin(above / steepest, sqrt(nearest2)), lane_of(shortest));
      outside = lane_where(far, t, outside);
      t = lane_where(far, t + step, t);
      live &= isless(t, end);
      far &= live;
    }
    if (!lane_any(live)) break;
    ilane executed;
    lane f = map_iterate(point_on(ray, t, slice), map, factors, iterations, true, &executed);
    ilane inside = live & isless(f, lane_of(level));
    // A hint that lies inside is taken back.
    ilane too_far = inside & isless(outside, start);
    inside &= lane_not(too_far);
    hit |= inside;
    live &= lane_not(inside);
    lane away = (f - far_level) * lane_exp(to_lane(executed) * log_shell);
    lane step = lane_where(too_far, -back, fmax(away, lane_of(shortest)));
    outside = lane_where(live & lane_not(too_far), t, outside);
    t = lane_where(live, t + step, t);
    outside = lane_where(too_far & islessequal(t, start), start, outside);
    t = fmax(t, start);
    back = lane_where(too_far, 2 * back, back);
    live &= isless(t, end);
  }
  ilane wide = hit & isgreater(t - outside, lane_of(tolerance));
  while (lane_any(wide)) {
    lane m = (real)0.5 * (outside + t);
    lane f = map_iterate(point_on(ray, m, slice), map, factors, iterations, true, 0);
    ilane inside = isless(f, lane_of(level));
    t = lane_where(wide & inside, m, t);
    outside = lane_where(wide & lane_not(inside), m, outside);
    wide &= isgreater(t - outside, lane_of(tolerance));
  }
  lane_store(lane_where(hit, (real)0.5 * (outside + t), lane_of(QJ_NO_HIT)), depth, g);
}
