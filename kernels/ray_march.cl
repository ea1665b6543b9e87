// First hits of rays with the iterated set {F_n < L}.
//
// Where F_1 >= ln r_out the next iterate escapes for certain, so F_1 alone (a potential, cheap)
// tells that a point is outside, and how far the undecided band {F_1 < ln r_out} is at least:
// (F_1 - ln r_out) / max |grad F_1|. In the band, orbits are run.

#include "map_step.clh"
#include "view.clh"

// Lanes are a block of neighbouring pixels, so that their rays do alike.
#if QJ_WIDTH == 16
#define BLOCK_COLUMNS 4
#define BLOCK_ROWS 4
#define LANE_COLUMN ((lane)(0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3))
#define LANE_ROW ((lane)(0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3))
#elif QJ_WIDTH == 8
#define BLOCK_COLUMNS 4
#define BLOCK_ROWS 2
#define LANE_COLUMN ((lane)(0, 1, 2, 3, 0, 1, 2, 3))
#define LANE_ROW ((lane)(0, 0, 0, 0, 1, 1, 1, 1))
#else
#define BLOCK_COLUMNS 1
#define BLOCK_ROWS 1
#define LANE_COLUMN lane_of(0)
#define LANE_ROW lane_of(0)
#endif

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

// Depths of `rows` rows of a view from `first_row` on; `depth` holds these rows, `columns` each.
// radius: of a ball about the origin that holds the set. steepest: greatest |grad F_1| about the
// band. shortest: the step in the band. Hits are bisected to shortest / 2^bisections.
// One work-item per block of BLOCK_COLUMNS x BLOCK_ROWS pixels.
kernel void march_depth(global const real* map, int factors, int iterations,
                        global const real* view, int columns, int first_row, int rows, real radius,
                        real steepest, real shortest, int bisections, global real* depth) {
  int column = (int)get_global_id(0) * BLOCK_COLUMNS;
  int row = (int)get_global_id(1) * BLOCK_ROWS;
  if (column >= columns || row >= rows) return;
  real slice = map[QJ_MAP_SLICE];
  real level = map[QJ_MAP_SURFACE_LEVEL];
  // One iterate decides every point by itself.
  real far_level = iterations == 1 ? level : fmin(map[QJ_MAP_LOG_ESCAPE], map[QJ_MAP_LOG_OUTER]);

  lane_ray ray = view_ray(view, LANE_COLUMN + (real)(column + (real)0.5),
                          LANE_ROW + (real)(row + first_row + (real)0.5));
  // The part of the ray inside the ball.
  lane middle = -fma(ray.ox, ray.dx, fma(ray.oy, ray.dy, ray.oz * ray.dz));
  lane o2 = fma(ray.ox, ray.ox, fma(ray.oy, ray.oy, ray.oz * ray.oz));
  lane half2 = fma(middle, middle, radius * radius - o2);
  lane half_chord = sqrt(fmax(half2, lane_of(0)));
  lane t = fmax(middle - half_chord, lane_of(0));
  lane end = middle + half_chord;

  lane outside = t;  // the last depth known to be outside
  ilane live = isgreater(half2, lane_of(0)) & isless(t, end);
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
    lane f = map_iterate(point_on(ray, t, slice), map, factors, iterations, true, 0);
    ilane inside = live & isless(f, lane_of(level));
    hit |= inside;
    live &= lane_not(inside);
    outside = lane_where(live, t, outside);
    t = lane_where(live, t + shortest, t);
    live &= isless(t, end);
  }
  if (lane_any(hit)) {
    for (int i = 0; i < bisections; ++i) {
      lane m = (real)0.5 * (outside + t);
      lane f = map_iterate(point_on(ray, m, slice), map, factors, iterations, true, 0);
      ilane inside = isless(f, lane_of(level));
      t = lane_where(inside, m, t);
      outside = lane_where(inside, outside, m);
    }
  }
  t = lane_where(hit, (real)0.5 * (outside + t), lane_of(QJ_NO_HIT));

  real depths[QJ_WIDTH];
  lane_store(t, depths, 0);
  for (int i = 0; i < QJ_WIDTH; ++i) {
    int x = column + i % BLOCK_COLUMNS, y = row + i / BLOCK_COLUMNS;
    if (x < columns && y < rows) depth[(size_t)y * (size_t)columns + (size_t)x] = depths[i];
  }
}
