// F_n at points whose orbits are looked up rather than computed, for large surfaces and for the
// loose pieces of pictures.
// Work-items are scalar, whatever the lane width.

#include "block_points.clh"
#include "looked_up_orbit.clh"

// F_n at points of the slice; NaN at those whose orbits cannot be looked up from their start on.
// points: three arrays X, Y, Z of `stride` reals. found: one.
kernel void look_up_points(global const real* points, int stride, int count, global const real* map,
                           int tabled, int iterations, global const real* nodes,
                           global const int* node_places, global const real* node_field,
                           global const real* node_versors, global const uchar* trusted,
                           global const real* table_layout, global const int* table_bricks,
                           global const ushort* table_fields, global const char* table_versors,
                           global real* found) {
  int item = (int)get_global_id(0);
  if (item >= count) return;
  image_lattice lattice = {nodes, node_places, node_field, node_versors, trusted, 0};
  image_table table = {table_layout, table_bricks, table_fields, table_versors};
  orbit_lookup with = lookup_of(lattice, table, tabled, iterations, map);
  real3 start = (real3)(points[item], points[stride + item], points[2 * stride + item]);
  last_iterate last;
  found[item] = looked_up_orbit(&with, start, map, &last) ? last.f : (real)NAN;
}

// F_n of orbits that iterate number `done` has taken to known points. The images of the points
// number live[i] among `points` are computed, whose F `field` holds; later iterates are looked up.
// live: groups * QJ_WIDTH numbers. points: four arrays X, Y, Z, W of `stride` reals. found: in the
// order of `live`.
kernel void look_up_rest(global const real* points, global const real* field, int stride,
                         global const int* live, int first_group, int groups,
                         global const real* map, int factors, int done, int iterations,
                         global const real* table_layout, global const int* table_bricks,
                         global const ushort* table_fields, global const char* table_versors,
                         global real* found) {
  int item = (int)get_global_id(0);
  if (item >= groups) return;
  int g = first_group + item;
  image_lattice lattice = {0, 0, 0, 0, 0, 0};
  image_table table = {table_layout, table_bricks, table_fields, table_versors};
  orbit_lookup with = lookup_of(lattice, table, done + 1, iterations, map);
  qlane q = gathered_points(points, stride, live + g * QJ_WIDTH);
  q = map_image(q, gathered(field, live + g * QJ_WIDTH), map, factors);
  real x[QJ_WIDTH], y[QJ_WIDTH], z[QJ_WIDTH], w[QJ_WIDTH];
  lane_store(q.x, x, 0), lane_store(q.y, y, 0), lane_store(q.z, z, 0), lane_store(q.w, w, 0);
  for (int i = 0; i < QJ_WIDTH; ++i) {
    found[g * QJ_WIDTH + i] = orbit_in_table(&with, (real4)(x[i], y[i], z[i], w[i]), done, map).f;
  }
}
