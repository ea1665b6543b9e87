// First hits of rays with the iterated set {F_n < L}.
//
// Where F_1 >= ln r_out the next iterate escapes for certain, so F_1 alone tells that a point is
// outside, and how far the undecided band {F_1 < ln r_out} is at least: (F_1 - ln r_out) /
// max |grad F_1|. F_1 is smooth, so these safe steps are read from a grid. In the band, orbits are
// run. An orbit that escapes with its m-th iterate tells a distance too: each iterate stretches by
// about |grad F_1|, so that it is about (F_m - ln r_out) / |grad F_1|^m.

#include "grid.clh"
#include "layout/march.h"
#include "map.clh"
#include "view.clh"

static inline qlane point_on(lane_ray r, lane t, real slice) {
  return q_make(fma(t, r.dx, r.ox), fma(t, r.dy, r.oy), fma(t, r.dz, r.oz), lane_of(slice));
}

// Narrows start … end to the ray's part inside the box that is seen; start = end where that is
// none.
static inline void clip_to_seen(global const real* grid, lane_ray r, lane* start, lane* end) {
  lane o[3] = {r.ox, r.oy, r.oz}, d[3] = {r.dx, r.dy, r.dz};
  for (int i = 0; i < 3; ++i) {
    // A ray along a face of the box runs inside or outside of it: neither bound is NaN.
    lane speed = lane_where(isless(fabs(d[i]), lane_of((real)1e-9f)), lane_of((real)1e-9f), d[i]);
    lane a = (grid[QJ_GRID_SEEN_LOW + i] - o[i]) / speed;
    lane b = (grid[QJ_GRID_SEEN_HIGH + i] - o[i]) / speed;
    *start = fmax(*start, fmin(a, b));
    *end = fmin(*end, fmax(a, b));
  }
  *end = fmax(*end, *start);
}

// How far the band {F_1 < far_level} is from each point of a grid, at least; not above 0 in it. One
// work-item per QJ_WIDTH points, from `first_group` on; safe: groups * QJ_WIDTH elements.
kernel void safe_steps(global const real* grid, int first_group, int groups, global const real* map,
                       int factors, int iterations, real far_level, real steepest,
                       global real* safe) {
  int g = (int)get_global_id(0);
  if (g >= groups) return;
  int nx = (int)grid[QJ_GRID_POINTS], ny = (int)grid[QJ_GRID_POINTS + 1];
  ilane index = LANE_NUMBERS + (ilane)(first_group + g) * QJ_WIDTH;
  ilane row = index / nx;
  real step = grid[QJ_GRID_STEP];
  lane x = fma(to_lane(index % nx), lane_of(step), lane_of(grid[QJ_GRID_ORIGIN]));
  lane y = fma(to_lane(row % ny), lane_of(step), lane_of(grid[QJ_GRID_ORIGIN + 1]));
  lane z = fma(to_lane(row / ny), lane_of(step), lane_of(grid[QJ_GRID_ORIGIN + 2]));
  qlane q = q_make(x, y, z, lane_of(map[QJ_MAP_SLICE]));
  lane_store(map_safe_step(q, map, factors, iterations, far_level, steepest), safe, g);
}

// Depths along rays of a view. rays: three arrays of march.stride reals, the pixel coordinates x
// and y of each ray and a hint: a depth close before its hit, or 0. grid, safe: of `safe_steps`.
//
// A work-item has the rays item * march.share ... of march.count. Its lanes go each its own way: a
// turn of the loop is one iterate for every lane, and a lane whose ray has ended takes the next
// one. What a ray finds does not depend on its companions.
kernel void march_depth(global const real* map, int factors, qj_march march,
                        global const real* view, global const real* rays, global const real* grid,
                        global const real* safe, global real* depth) {
  int next_ray = (int)get_global_id(0) * march.share;
  if (next_ray >= march.count) return;
  int last_ray = min(next_ray + march.share, march.count);
  real slice = map[QJ_MAP_SLICE];
  real level = map[QJ_MAP_SURFACE_LEVEL];
  real above = fmin(map[QJ_MAP_LOG_ESCAPE], map[QJ_MAP_LOG_OUTER]);
  real below = map[QJ_MAP_LOG_INNER];
  // One iterate decides every point by itself.
  real far_level = march.iterations == 1 ? level : above;
  real log_shell = -log(march.steepest);
  // Nearer than this to the band, orbits tell what the grid is too coarse for.
  real near = (real)0.25 * grid[QJ_GRID_STEP];

  int id[QJ_WIDTH];
  real values[QJ_WIDTH], ends[QJ_WIDTH];
  QJ_INT flags[QJ_WIDTH];
  real pixel_x[QJ_WIDTH], pixel_y[QJ_WIDTH], hints[QJ_WIDTH];
  real ox[QJ_WIDTH], oy[QJ_WIDTH], oz[QJ_WIDTH], dx[QJ_WIDTH], dy[QJ_WIDTH], dz[QJ_WIDTH];
  for (int i = 0; i < QJ_WIDTH; ++i) pixel_x[i] = pixel_y[i] = hints[i] = 0;

  lane_ray ray;
  ray.ox = ray.oy = ray.oz = ray.dx = ray.dy = ray.dz = lane_of(0);
  lane start = lane_of(0), end = start, t = start;
  lane outside = start;  // the last depth known to be outside; below `start` where none is known
  lane back = start;     // how far a hint that lies inside is taken back
  lane probe = start;    // the depth whose orbit is run
  qlane q = q_make(start, start, start, start);
  ilane done = (ilane)0;  // iterates of the orbit
  ilane live = (ilane)0;  // has a ray
  ilane hit = (ilane)0;   // is bisecting
  for (;;) {
    // New rays for lanes without one, and steps up to the band.
    for (;;) {
      if (!lane_all(live) && next_ray < last_ray) {
        lane_store(live, flags, 0);
        for (int i = 0; i < QJ_WIDTH; ++i) {
          QJ_INT idle = flags[i] == 0 && next_ray < last_ray;
          if (idle) {
            id[i] = next_ray++;
            pixel_x[i] = rays[id[i]];
            pixel_y[i] = rays[march.stride + id[i]];
            hints[i] = rays[2 * march.stride + id[i]];
          }
          flags[i] = -idle;
        }
        ilane fresh = (ilane)(lane_load(flags, 0));
        ray = view_ray(view, lane_load(pixel_x, 0), lane_load(pixel_y, 0));
        // The part of the ray inside the ball.
        lane middle = -fma(ray.ox, ray.dx, fma(ray.oy, ray.dy, ray.oz * ray.dz));
        lane o2 = fma(ray.ox, ray.ox, fma(ray.oy, ray.oy, ray.oz * ray.oz));
        lane half2 = fma(middle, middle, march.radius * march.radius - o2);
        lane half_chord = sqrt(fmax(half2, lane_of(0)));
        start = fmax(middle - half_chord, lane_of(0));
        end = lane_where(isgreater(half2, lane_of(0)), middle + half_chord, start);
        clip_to_seen(grid, ray, &start, &end);
        lane first = fmax(lane_load(hints, 0), start);
        t = lane_where(fresh, first, t);
        outside =
            lane_where(fresh, lane_where(isgreater(first, start), lane_of(-1), start), outside);
        back = lane_where(fresh, lane_of(4 * march.shortest), back);
        done = ilane_where(fresh, (ilane)0, done);
        hit &= lane_not(fresh);
        live |= fresh;
        lane_store(ray.ox, ox, 0), lane_store(ray.oy, oy, 0), lane_store(ray.oz, oz, 0);
        lane_store(ray.dx, dx, 0), lane_store(ray.dy, dy, 0), lane_store(ray.dz, dz, 0);
        lane_store(end, ends, 0);
      }
      lane_store(t, values, 0);
      lane_store(live & lane_not(hit) & (ilane)(done == 0), flags, 0);
      for (int i = 0; i < QJ_WIDTH; ++i) {
        if (flags[i] == 0) continue;
        real s = values[i];
        while (s < ends[i]) {
          real step = grid_value(grid, safe, fma(s, dx[i], ox[i]), fma(s, dy[i], oy[i]),
                                 fma(s, dz[i], oz[i]));
          if (step < near) break;
          s += step;
        }
        if (s >= ends[i]) depth[id[i]] = QJ_NO_HIT;
        values[i] = s;
      }
      ilane marching = (ilane)(lane_load(flags, 0));
      lane reached = lane_load(values, 0);
      ilane advanced = marching & isgreater(reached, t);
      outside = lane_where(advanced, fmax(reached - near, start), outside);
      t = reached;
      live &= lane_not(marching & isgreaterequal(t, end));
      if (lane_all(live) || next_ray >= last_ray) break;
    }
    if (!lane_any(live)) return;

    // One iterate.
    ilane begin = (ilane)(done == 0);
    probe = lane_where(begin, lane_where(hit, (real)0.5 * (outside + t), t), probe);
    qlane p = point_on(ray, probe, slice);
    q = q_where(begin, p, q);
    qlane u = q;
    lane f = march.iterations == 1 ? map_modulus(q, map, factors) : map_step(q, map, factors, &u);
    done += 1;
    q = q_scale(lane_exp(fmin(f, lane_of((real)40))), u);
    ilane ended = live & ((ilane)(done >= march.iterations) | islessequal(f, lane_of(below)) |
                          isgreaterequal(f, lane_of(above)));

    // What orbits that ended tell.
    ilane inside = ended & isless(f, lane_of(level));
    ilane bisected = ended & hit;
    ilane marched = ended & lane_not(hit);
    t = lane_where(bisected & inside, probe, t);
    outside = lane_where((bisected | marched) & lane_not(inside), probe, outside);
    // A hint that lies inside is taken back.
    ilane too_far = marched & inside & isless(outside, start);
    hit |= marched & inside & lane_not(too_far);
    lane away =
        fmin((f - far_level) * lane_exp(to_lane(done) * log_shell), lane_of(grid[QJ_GRID_STEP]));
    t = lane_where(marched & lane_not(inside), t + fmax(away, lane_of(march.shortest)), t);
    t = lane_where(too_far, fmax(t - back, start), t);
    outside = lane_where(too_far & islessequal(t, start), start, outside);
    back = lane_where(too_far, 2 * back, back);
    done = ilane_where(ended, (ilane)0, done);

    ilane found = hit & live & islessequal(t - outside, lane_of(march.tolerance));
    if (lane_any(found)) {
      lane_store(found, flags, 0);
      lane_store((real)0.5 * (outside + t), values, 0);
      for (int i = 0; i < QJ_WIDTH; ++i) {
        if (flags[i] != 0) depth[id[i]] = values[i];
      }
      live &= lane_not(found);
    }
  }
}
