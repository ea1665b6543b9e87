// F_n at the points of a regular grid, coordinates made on the device. F_n here is the decided one:
// orbits also end at r_in and r_out (map_iterate).

#include "map_step.clh"

// The points numbered `index` (x fastest, then y) of the block of nx * ny * ... grid points that
// begins at grid point (ix, iy, iz). Grid point (i, j, k) is origin + step (i, j, k).
inline qlane block_point(ilane index, int nx, int ny, int ix, int iy, int iz, real origin_x,
                         real origin_y, real origin_z, real step, real slice) {
  ilane row = index / nx;
  ilane layer = row / ny;
  lane i = to_lane(index - row * nx + ix);
  lane j = to_lane(row - layer * ny + iy);
  lane k = to_lane(layer + iz);
  lane h = lane_of(step);
  return q_make(fma(i, h, lane_of(origin_x)), fma(j, h, lane_of(origin_y)),
                fma(k, h, lane_of(origin_z)), lane_of(slice));
}

// F_n at points `first_group` * QJ_WIDTH and on, one work-item per QJ_WIDTH points, `groups` of
// them; points past the block's end lie on further layers and are harmless.
// field: groups * QJ_WIDTH reals.
kernel void level_set_block(int nx, int ny, int ix, int iy, int iz, real origin_x, real origin_y,
                            real origin_z, real step, int first_group, int groups,
                            global const real* map, int factors, int iterations,
                            global real* field) {
  int g = (int)get_global_id(0);
  if (g >= groups) return;
  ilane index = LANE_NUMBERS + (ilane)(first_group + g) * QJ_WIDTH;
  qlane q =
      block_point(index, nx, ny, ix, iy, iz, origin_x, origin_y, origin_z, step, map[QJ_MAP_SLICE]);
  lane_store(map_iterate(q, map, factors, iterations, true, 0), field, g);
}

// The same at the listed points of the block. indices, field: groups * QJ_WIDTH elements.
kernel void level_set_points(int nx, int ny, int ix, int iy, int iz, real origin_x, real origin_y,
                             real origin_z, real step, global const int* indices, int groups,
                             global const real* map, int factors, int iterations,
                             global real* field) {
  int g = (int)get_global_id(0);
  if (g >= groups) return;
  ilane index = to_ilane(lane_load(indices, g));
  qlane q =
      block_point(index, nx, ny, ix, iy, iz, origin_x, origin_y, origin_z, step, map[QJ_MAP_SLICE]);
  lane_store(map_iterate(q, map, factors, iterations, true, 0), field, g);
}
