// F_n at the points of a regular grid, coordinates made on the device. F_n here is the decided one:
// orbits also end at the map's r_in and r_out, where it has them (map_iterate).

#include "block_points.clh"
#include "map_step.clh"

// Points number g * QJ_WIDTH and on of four arrays X, Y, Z, W of `stride` reals.
inline void store_point(qlane q, global real* points, int stride, int g) {
  lane_store(q.x, points, g);
  lane_store(q.y, points + stride, g);
  lane_store(q.z, points + 2 * stride, g);
  lane_store(q.w, points + 3 * stride, g);
}

// F_n at points `first_group` * QJ_WIDTH and on, one work-item per QJ_WIDTH points, `groups` of
// them; points past the block's end lie on further layers and are harmless. Every orbit runs until
// it escapes or n iterates are done. Where it ends on the side of `level` that it was on at its
// first iterate beyond r_in or r_out, as it should, F_n is the F of that iterate; else of its end.
// field: groups * QJ_WIDTH reals.
kernel void level_set_dense(int nx, int ny, int ix, int iy, int iz, real origin_x, real origin_y,
                            real origin_z, real step, int first_group, int groups,
                            global const real* map, int factors, int iterations, real level,
                            global real* field) {
  int g = (int)get_global_id(0);
  if (g >= groups) return;
  real escape = map[QJ_MAP_LOG_ESCAPE];
  real above = fmin(escape, map[QJ_MAP_LOG_OUTER]), below = map[QJ_MAP_LOG_INNER];
  ilane index = LANE_NUMBERS + (ilane)(first_group + g) * QJ_WIDTH;
  qlane q = block_point(index, nx, ny, 1, ix, iy, iz, origin_x, origin_y, origin_z, step,
                        map[QJ_MAP_SLICE]);
  lane end = map_log_radius(q);
  lane decided = end;
  ilane live = isless(end, lane_of(escape));
  ilane undecided = live;
  for (int i = 0; i < iterations && lane_any(live); ++i) {
    lane next = map_log_norm(q, map, factors);
    end = lane_where(live, next, end);
    decided = lane_where(undecided, next, decided);
    live &= isless(next, lane_of(escape));
    undecided &= isless(next, lane_of(above)) & isgreater(next, lane_of(below));
    if (i + 1 == iterations || !lane_any(live)) break;
    q = q_where(live, map_image(q, next, map, factors), q);
  }
  ilane differ = isless(end, lane_of(level)) ^ isless(decided, lane_of(level));
  lane_store(lane_where(differ, end, decided), field, g);
}

// The first iterate of points given by their numbers in a block of grid points: their places into
// `points`, their F_1 into `field`. numbers: groups * QJ_WIDTH of them. points: four arrays X, Y,
// Z, W of `stride` reals, a multiple of QJ_WIDTH. field: `stride` reals.
kernel void level_set_numbered(global const int* numbers, int nx, int ny, int ix, int iy, int iz,
                               real origin_x, real origin_y, real origin_z, real step, int stride,
                               int groups, global const real* map, int factors, global real* points,
                               global real* field) {
  int g = (int)get_global_id(0);
  if (g >= groups) return;
  qlane q = block_point(point_numbers(numbers, g), nx, ny, 1, ix, iy, iz, origin_x, origin_y,
                        origin_z, step, map[QJ_MAP_SLICE]);
  store_point(q, points, stride, g);
  lane_store(map_iterate(q, map, factors, 1, true, 0), field, g);
}

// The same for points anywhere on the slice: X, Y and Z are given, W is set.
kernel void level_set_points(global real* points, int stride, int groups, global const real* map,
                             int factors, global real* field) {
  int g = (int)get_global_id(0);
  if (g >= groups) return;
  qlane q = q_make(lane_load(points, g), lane_load(points + stride, g),
                   lane_load(points + 2 * stride, g), lane_of(map[QJ_MAP_SLICE]));
  store_point(q, points, stride, g);
  lane_store(map_iterate(q, map, factors, 1, true, 0), field, g);
}

// One iterate on from points whose F is known: the images of the points number live[i] among
// `points`, and the F of these images, for i from `first_group` * QJ_WIDTH on. live: whole groups.
// points, images: four arrays X, Y, Z, W of `stride` reals, a multiple of QJ_WIDTH. field,
// image_field: `stride` reals.
kernel void level_set_advance(global const real* points, global const real* field, int stride,
                              global const int* live, int first_group, int groups,
                              global const real* map, int factors, global real* images,
                              global real* image_field) {
  int item = (int)get_global_id(0);
  if (item >= groups) return;
  int g = first_group + item;
  real x[QJ_WIDTH], y[QJ_WIDTH], z[QJ_WIDTH], w[QJ_WIDTH], f[QJ_WIDTH];
  for (int i = 0; i < QJ_WIDTH; ++i) {
    int from = live[g * QJ_WIDTH + i];
    x[i] = points[from];
    y[i] = points[stride + from];
    z[i] = points[2 * stride + from];
    w[i] = points[3 * stride + from];
    f[i] = field[from];
  }
  qlane q = q_make(lane_load(x, 0), lane_load(y, 0), lane_load(z, 0), lane_load(w, 0));
  q = map_image(q, lane_load(f, 0), map, factors);
  store_point(q, images, stride, g);
  lane_store(map_log_norm(q, map, factors), image_field, g);
}

// Bounds of F_1 over cubes in the slice: centre as given, `half` a side. About a centre c, with
// d_k = c - c_k and h the half diagonal, ln |d + s| differs from its Taylor polynomial of degree 2
// by at most t^3 / (3 (1 - t)), t = h / |d| < 1: it is the real part of ln(1 + t e^(i phi)) =
// sum (-1)^(m+1) (t e^(i phi))^m / m. So a factor with t < 1/2 adds its gradient and Hessian, which
// cancel between roots and poles, and a remainder, which does not. A nearer one adds the range of
// ln over the distances its cube can have. Computed values of F_0 and F_1 lie within the bounds:
// they are widened by what rounding can do.
// centers: three arrays X, Y, Z of `stride` reals. low, high: `stride` reals.
kernel void level_set_bounds(global const real* centers, int stride, int groups, real half_side,
                             global const real* map, int factors, global real* low,
                             global real* high) {
  int g = (int)get_global_id(0);
  if (g >= groups) return;
  global const real* a = MAP_COMPONENT(map, factors, QJ_MAP_EXPONENT);
  global const real* cx = MAP_COMPONENT(map, factors, QJ_MAP_CENTER_X);
  global const real* cy = MAP_COMPONENT(map, factors, QJ_MAP_CENTER_Y);
  global const real* cz = MAP_COMPONENT(map, factors, QJ_MAP_CENTER_Z);
  global const real* cw = MAP_COMPONENT(map, factors, QJ_MAP_CENTER_W);
  qlane q = q_make(lane_load(centers, g), lane_load(centers + stride, g),
                   lane_load(centers + 2 * stride, g), lane_of(map[QJ_MAP_SLICE]));
  lane zero = lane_of(0), half_log2 = lane_of((real)0.5 * QJ_LN2);
  lane reach = lane_of(half_side * (real)1.7320509f);
  lane middle = zero, below = zero, above = zero, rounding = lane_of(fabs(map[QJ_MAP_LOG_SCALE]));
  lane gx = zero, gy = zero, gz = zero;
  lane xx = zero, yy = zero, zz = zero, xy = zero, xz = zero, yz = zero;
  for (int k = 0; k < factors; ++k) {
    lane dx = q.x - cx[k], dy = q.y - cy[k], dz = q.z - cz[k], dw = q.w - cw[k];
    lane w2 = fma(dw, dw, lane_of(QJ_TINY));
    lane n = fma(dx, dx, fma(dy, dy, fma(dz, dz, w2)));
    lane logarithm = lane_log2(n) * half_log2;
    middle = fma(lane_of(a[k]), logarithm, middle);
    rounding = fma(lane_of(fabs(a[k])), fabs(logarithm) + 1, rounding);
    lane inverse = 1 / n;
    lane distance = n * lane_rsqrt(n);
    lane t = reach / distance;
    ilane is_near = isgreater(t, lane_of((real)0.5));
    lane weight = lane_where(is_near, zero, a[k] * inverse);
    gx = fma(weight, dx, gx);
    gy = fma(weight, dy, gy);
    gz = fma(weight, dz, gz);
    lane twice = -2 * weight * inverse;
    xx += fma(twice, dx * dx, weight);
    yy += fma(twice, dy * dy, weight);
    zz += fma(twice, dz * dz, weight);
    xy = fma(twice, dx * dy, xy);
    xz = fma(twice, dx * dz, xz);
    yz = fma(twice, dy * dz, yz);
    lane remainder = fabs(a[k]) * t * t * t / (3 * (1 - t));
    lane shortest = fmax(distance - reach, zero);
    lane longest = distance + reach;
    lane closest = a[k] * fma(lane_log2(fmax(shortest * shortest, w2)), half_log2, -logarithm);
    lane furthest = a[k] * fma(lane_log2(longest * longest), half_log2, -logarithm);
    below += lane_where(is_near, fmin(closest, furthest), -remainder);
    above += lane_where(is_near, fmax(closest, furthest), remainder);
  }
  lane linear = half_side * (fabs(gx) + fabs(gy) + fabs(gz));
  lane norm2 = xx * xx + yy * yy + zz * zz + 2 * (xy * xy + xz * xz + yz * yz);
  lane quadratic = (real)0.5 * reach * reach * sqrt(norm2);
  lane spread = fma(rounding, lane_of((real)1e-6f), linear + quadratic) * (real)1.0001f;
  middle += map[QJ_MAP_LOG_SCALE];
  lane lowest = middle + below - spread;
  lane highest = middle + above + spread;
  if (map[QJ_MAP_KIND] != 0) {
    // |(q + s)^2 - q^2| <= 2 |q| |s| + |s|^2.
    qlane image = map_square(q, map);
    lane size = sqrt(q_dot(image, image));
    lane change = fma(2 * sqrt(q_dot(q, q)), reach, reach * reach) * (real)1.0001f;
    lane least = fmax(size - change, lane_of(QJ_TINY_ROOT));
    lowest = fma(2 * half_log2, lane_log2(least), lane_of(map[QJ_MAP_LOG_SCALE] - (real)1e-4f));
    highest =
        fma(2 * half_log2, lane_log2(size + change), lane_of(map[QJ_MAP_LOG_SCALE] + (real)1e-4f));
  }
  // Beyond the escape radius the field is ln |q|.
  lane farthest = half_log2 * 2 * lane_log2(sqrt(fmax(q_dot(q, q), lane_of(QJ_TINY))) + reach);
  ilane escapes = isgreater(farthest, lane_of(map[QJ_MAP_LOG_ESCAPE] - (real)1e-4f));
  lowest = lane_where(escapes, fmin(lowest, lane_of(map[QJ_MAP_LOG_ESCAPE] - (real)1e-4f)), lowest);
  highest = lane_where(escapes, fmax(highest, farthest + (real)1e-4f), highest);
  lane_store(lowest, low, g);
  lane_store(highest, high, g);
}
