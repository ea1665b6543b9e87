// F_n at the points of a regular grid, coordinates made on the device. F_n here is the decided one:
// orbits also end at the map's r_in and r_out, where it has them (map_iterate).

#include "block_points.clh"
#include "map.clh"

// F_n at points `first_group` * QJ_WIDTH and on, one work-item per QJ_WIDTH points, `groups` of
// them; points past the block's end lie on further layers and are harmless. Every orbit runs until
// it escapes or n iterates are done. Where it ends on the side of `level` that it was on at its
// first iterate beyond r_in or r_out, as it should, F_n is the F of that iterate; else of its end.
// field: groups * QJ_WIDTH reals.
kernel void level_set_dense(qj_grid_block block, int first_group, int groups,
                            global const real* map, int factors, int iterations, real level,
                            global real* field) {
  int g = (int)get_global_id(0);
  if (g >= groups) return;
  real escape = map[QJ_MAP_LOG_ESCAPE];
  real above = fmin(escape, map[QJ_MAP_LOG_OUTER]), below = map[QJ_MAP_LOG_INNER];
  ilane index = LANE_NUMBERS + (ilane)(first_group + g) * QJ_WIDTH;
  qlane q = block_point(index, block, 1, map[QJ_MAP_SLICE]);
  lane end = map_log_radius(q);
  lane decided = end;
  ilane live = isless(end, lane_of(escape));
  ilane undecided = live;
  for (int i = 0; i < iterations && lane_any(live); ++i) {
    lane next = map_modulus(q, map, factors);
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
kernel void level_set_numbered(global const int* numbers, qj_grid_block block, int stride,
                               int groups, global const real* map, int factors, global real* points,
                               global real* field) {
  int g = (int)get_global_id(0);
  if (g >= groups) return;
  qlane q = block_point(point_numbers(numbers, g), block, 1, map[QJ_MAP_SLICE]);
  q_store(q, points, stride, g);
  lane_store(map_iterate(q, map, factors, 1, true, 0), field, g);
}

// F_1 at points anywhere on the slice: X, Y and Z are given, W is set.
kernel void level_set_points(global real* points, int stride, int groups, global const real* map,
                             int factors, global real* field) {
  int g = (int)get_global_id(0);
  if (g >= groups) return;
  qlane q = q_make(lane_load(points, g), lane_load(points + stride, g),
                   lane_load(points + 2 * stride, g), lane_of(map[QJ_MAP_SLICE]));
  q_store(q, points, stride, g);
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
  qlane q = gathered_points(points, stride, live + g * QJ_WIDTH);
  q = map_image(q, gathered(field, live + g * QJ_WIDTH), map, factors);
  q_store(q, images, stride, g);
  lane_store(map_modulus(q, map, factors), image_field, g);
}

// Bounds of the field over cubes in the slice that reach `half_side` from their centres along each
// axis: those of map_bounds, and where they reach beyond the escape radius, of ln |q|. centers:
// three arrays X, Y, Z of `stride` reals. bounds: two, the lowest and the highest.
kernel void level_set_bounds(global const real* centers, int stride, int groups, real half_side,
                             global const real* map, int factors, int iterations,
                             global real* bounds) {
  int g = (int)get_global_id(0);
  if (g >= groups) return;
  qlane q = q_make(lane_load(centers, g), lane_load(centers + stride, g),
                   lane_load(centers + 2 * stride, g), lane_of(map[QJ_MAP_SLICE]));
  lane lowest, highest;
  map_bounds(q, half_side, map, factors, iterations, &lowest, &highest);
  lane ln2 = lane_of(QJ_LN2), reach = lane_of(half_side * (real)1.7320509f);
  lane farthest = ln2 * lane_log2(sqrt(fmax(q_dot(q, q), lane_of(QJ_TINY))) + reach);
  ilane escapes = isgreater(farthest, lane_of(map[QJ_MAP_LOG_ESCAPE] - (real)1e-4f));
  lowest = lane_where(escapes, fmin(lowest, lane_of(map[QJ_MAP_LOG_ESCAPE] - (real)1e-4f)), lowest);
  highest = lane_where(escapes, fmax(highest, farthest + (real)1e-4f), highest);
  lane_store(lowest, bounds, g);
  lane_store(highest, bounds + stride, g);
}
