// What a table of images is made from (image_table.clh): bounds of F over its bricks, F and U at
// its nodes; and what it then says of points. points: four arrays X, Y, Z, W of `stride` reals
// each, a multiple of QJ_WIDTH; one work-item per QJ_WIDTH points, `groups` of them. Of the map's
// kinds alone, without steepness, paint and portals.

#include "image_table.clh"

#ifdef QJ_FACTORS_MODULUS
// Least and greatest F over cubes of four dimensions about the points. bounds: two arrays.
kernel void cube_bounds(global const real* points, int stride, int groups, real half_side,
                        global const real* map, int factors, global real* bounds) {
  int g = (int)get_global_id(0);
  if (g >= groups) return;
  lane lowest, highest;
  kind_modulus_cube_bounds(q_load(points, stride, g), half_side, map, factors, &lowest, &highest);
  lane_store(lowest, bounds, g);
  lane_store(highest, bounds + stride, g);
}
#endif

// F. field: one array.
kernel void node_fields(global const real* points, int stride, int groups, global const real* map,
                        int factors, global real* field) {
  int g = (int)get_global_id(0);
  if (g >= groups) return;
  lane_store(kind_modulus(q_load(points, stride, g), map, factors), field, g);
}

// U. versors: four arrays.
kernel void node_versors(global const real* points, int stride, int groups, global const real* map,
                         int factors, global real* versors) {
  int g = (int)get_global_id(0);
  if (g >= groups) return;
  q_store(map_versor(q_load(points, stride, g), map, factors), versors, stride, g);
}

// What the table says of points: F, and U or 0 where it has none. images: five arrays.
kernel void table_images(global const real* points, int stride, int groups,
                         global const real* layout, global const int* bricks,
                         global const ushort* fields, global const char* versors,
                         global real* images) {
  int g = (int)get_global_id(0);
  if (g >= groups) return;
  image_table table = {layout, bricks, fields, versors};
  for (int i = g * QJ_WIDTH; i < (g + 1) * QJ_WIDTH; ++i) {
    table_place place = place_in_table(
        table,
        (real4)(points[i], points[stride + i], points[2 * stride + i], points[3 * stride + i]));
    real f = place.state == QJ_TABLE_INSIDE ? layout[QJ_TABLE_FIELD]
             : place.state < 0              ? table_bound(table, place)
                                            : table_field(table, place);
    real4 u = place.state < 0 ? (real4)(0) : table_versor(table, place);
    u *= rsqrt(fmax(dot(u, u), (real)1));
    images[i] = f;
    images[stride + i] = u.x, images[2 * stride + i] = u.y;
    images[3 * stride + i] = u.z, images[4 * stride + i] = u.w;
  }
}
