// Where grid points and their images lie, predicted. Within a slice F and the versor U are smooth
// but for U on the lines where some q - c_k is real and negative. So both are computed at nodes,
// every `spacing` points along x and y, and interpolated: first along y, to every row; then along
// x, to the points. What is left to evaluate of the second iterate is F alone. The F interpolated
// is that of the map's kind, which is smooth where the map's own bends (map_steep).
//
// The nodes of a slice form a lattice; node (0, 0) lies 2 * spacing points before the first point
// of the slice, so that every point has two nodes before that at or before it, and three after.

#include "block_points.clh"
#include "layout/settling.h"
#include "map.clh"

// The kind's F and U at the points of these numbers in a block of grid points (block_point), as
// numbers slots[i] among `field`, and four reals each among `versors`.
kernel void block_images(global const int* numbers, global const int* slots, qj_grid_block block,
                         int spacing, int first_group, int groups, global const real* map,
                         int factors, global real* field, global real* versors) {
  int item = (int)get_global_id(0);
  if (item >= groups) return;
  int g = first_group + item;
  qlane q = block_point(point_numbers(numbers, g), block, spacing, map[QJ_MAP_SLICE]);
  qlane u;
  real f[QJ_WIDTH], x[QJ_WIDTH], y[QJ_WIDTH], z[QJ_WIDTH], w[QJ_WIDTH];
  lane_store(kind_step(q, map, factors, &u), f, 0);
  lane_store(u.x, x, 0);
  lane_store(u.y, y, 0);
  lane_store(u.z, z, 0);
  lane_store(u.w, w, 0);
  for (int i = 0; i < QJ_WIDTH; ++i) {
    int slot = slots[g * QJ_WIDTH + i];
    field[slot] = f[i];
    vstore4((real4)(x[i], y[i], z[i], w[i]), slot, versors);
  }
}

// F and U, not of length 1; or differences of them.
typedef struct {
  lane f;
  qlane u;
} log_image;

// Nodes -2 ... 3; node m is number nodes[i] + m * stride.
static inline void load_nodes(global const real* field, global const real* versors,
                              const int* nodes, int stride, log_image* images) {
  for (int m = 0; m < 6; ++m) {
    real f[QJ_WIDTH], x[QJ_WIDTH], y[QJ_WIDTH], z[QJ_WIDTH], w[QJ_WIDTH];
    for (int i = 0; i < QJ_WIDTH; ++i) {
      int node = nodes[i] + (m - 2) * stride;
      f[i] = field[node];
      real4 u = vload4(node, versors);
      x[i] = u.x;
      y[i] = u.y;
      z[i] = u.z;
      w[i] = u.w;
    }
    images[m].f = lane_load(f, 0);
    images[m].u = q_make(lane_load(x, 0), lane_load(y, 0), lane_load(z, 0), lane_load(w, 0));
  }
}

static inline lane log_image_size(log_image of) {
#ifdef QJ_MODULUS_IS_CHEAP
  return sqrt(q_dot(of.u, of.u));  // F itself is at hand
#else
  return fabs(of.f) + sqrt(q_dot(of.u, of.u));
#endif
}

static inline log_image weighted(const log_image* images, const lane* weights) {
  log_image sum;
  sum.f = weights[0] * images[0].f;
  sum.u = q_scale(weights[0], images[0].u);
  for (int i = 1; i < 6; ++i) {
    qlane u = images[i].u;
    sum.f = fma(weights[i], images[i].f, sum.f);
    sum.u = q_make(fma(weights[i], u.x, sum.u.x), fma(weights[i], u.y, sum.u.y),
                   fma(weights[i], u.z, sum.u.z), fma(weights[i], u.w, sum.u.w));
  }
  return sum;
}

// Weights of Lagrange's polynomial through six nodes m = -2 ... 3, at s in [0, 1], and what they
// differ by from those of the polynomial through m = -1 ... 2. Of the four: products of s - j over
// (m - j), j from -1 to 2 but m; of the six, these times (s + 2) (s - 3) / ((m + 2) (m - 3)).
static inline void lagrange_weights(lane s, lane* six, lane* difference) {
  lane a = s + 1, b = s - 1, c = s - 2;
  lane outer = (s + 2) * (s - 3);
  lane ends = a * s * b * c * (real)(1.0f / 120);
  lane four[6] = {lane_of(0),
                  s * b * c * (real)(-1.0f / 6),
                  a * b * c * (real)0.5f,
                  a * s * c * (real)-0.5f,
                  a * s * b * (real)(1.0f / 6),
                  lane_of(0)};
  six[0] = ends * (3 - s);
  for (int i = 1; i < 5; ++i) six[i] = four[i] * outer * ((real)1 / (real)(i * (i - 5)));
  six[5] = ends * (s + 2);
  for (int i = 0; i < 6; ++i) difference[i] = six[i] - four[i];
}

// What a jump between the two middle nodes adds to the change, of their fifth difference, which is
// six times the jump. Half way between them it is all that tells.
#define QJ_JUMP_WEIGHT 0.03f

// F and U where the lattice's columns meet all rows of a block of `rows` rows a slice, from those
// at its nodes, of which it has `node_rows` rows a slice and `node_columns` columns. numbers: of
// the meetings to make, column fastest, then row. row_field, row_versors, row_change: by number.
kernel void interpolate_rows(global const int* numbers, int node_columns, int node_rows, int rows,
                             int spacing, global const real* field, global const real* versors,
                             int groups, global real* row_field, global real* row_versors,
                             global real* row_change) {
  int g = (int)get_global_id(0);
  if (g >= groups) return;
  int nodes[QJ_WIDTH];
  real ways[QJ_WIDTH];
  for (int i = 0; i < QJ_WIDTH; ++i) {
    int row = numbers[g * QJ_WIDTH + i] / node_columns;
    int column = numbers[g * QJ_WIDTH + i] - row * node_columns;
    int slice = row / rows;
    int y = row - slice * rows;
    nodes[i] = (slice * node_rows + y / spacing + 2) * node_columns + column;
    ways[i] = (real)(y % spacing) / (real)spacing;
  }
  lane s = lane_load(ways, 0);
  lane six[6], difference[6];
  lagrange_weights(s, six, difference);
  const lane fifth[6] = {lane_of(-1 * QJ_JUMP_WEIGHT),  lane_of(5 * QJ_JUMP_WEIGHT),
                         lane_of(-10 * QJ_JUMP_WEIGHT), lane_of(10 * QJ_JUMP_WEIGHT),
                         lane_of(-5 * QJ_JUMP_WEIGHT),  lane_of(1 * QJ_JUMP_WEIGHT)};
  log_image images[6];
  load_nodes(field, versors, nodes, node_columns, images);
  log_image r = weighted(images, six);
  lane change = log_image_size(weighted(images, difference));
  lane jump = log_image_size(weighted(images, fifth));
  change += lane_where(isgreater(s, lane_of(0)), jump, lane_of(0));
  real f[QJ_WIDTH], x[QJ_WIDTH], y[QJ_WIDTH], z[QJ_WIDTH], w[QJ_WIDTH], changes[QJ_WIDTH];
  lane_store(r.f, f, 0);
  lane_store(r.u.x, x, 0);
  lane_store(r.u.y, y, 0);
  lane_store(r.u.z, z, 0);
  lane_store(r.u.w, w, 0);
  lane_store(change, changes, 0);
  for (int i = 0; i < QJ_WIDTH; ++i) {
    int number = numbers[g * QJ_WIDTH + i];
    row_field[number] = f[i];
    vstore4((real4)(x[i], y[i], z[i], w[i]), number, row_versors);
    row_change[number] = changes[i];
  }
}

// F_1 interpolated, and F of an interpolated image, can be off by these times the changes of the
// interpolations. Measured along x, six fitted shapes at 512 cells and a detail of 2 %, nodes as
// far apart as the host puts them, 1,200 to 4,300 points each: U is within 6 times its change, F of
// images within 17 times at 99.9 % of points and within 20 times at all.
#define QJ_POINT_MARGIN ((real)8)
#define QJ_IMAGE_MARGIN ((real)40)
// What rounding may add to the changes.
#define QJ_INTERPOLATION_ROUNDING ((real)1e-5f)

// `f` moved towards `level` by what it can be off, but not past it; `level` itself where anything
// is not a number.
static inline lane short_of(lane f, lane off, lane level) {
  return lane_where(isgreater(f, level), lane_max(f - off, level), lane_min(f + off, level));
}

// F_1 of points where it is below settling.below or above settling.above for sure; F of their
// images where F_1 is between the stop radii for sure; each moved towards settling.level by what it
// can be off. That level for other points, and for those beyond the escape radius. numbers: of the
// points in the block. row_field, row_versors, row_change: as interpolate_rows makes them. settled:
// as many reals as numbers.
kernel void settle_points(global const int* numbers, qj_grid_block block, qj_settling settling,
                          global const real* row_field, global const real* row_versors,
                          global const real* row_change, int first_group, int groups,
                          global const real* map, int factors, global real* settled) {
  int item = (int)get_global_id(0);
  if (item >= groups) return;
  int g = first_group + item;
  real ways[QJ_WIDTH], changes[QJ_WIDTH];
  int nodes[QJ_WIDTH];
  for (int i = 0; i < QJ_WIDTH; ++i) {
    int row = numbers[g * QJ_WIDTH + i] / block.nx;
    int x = numbers[g * QJ_WIDTH + i] - row * block.nx;
    nodes[i] = row * settling.node_columns + x / settling.spacing + 2;
    ways[i] = (real)(x % settling.spacing) / (real)settling.spacing;
  }
  lane six[6], difference[6];
  lagrange_weights(lane_load(ways, 0), six, difference);
  log_image images[6];
  load_nodes(row_field, row_versors, nodes, 1, images);
  log_image r = weighted(images, six);
  lane change = QJ_INTERPOLATION_ROUNDING + log_image_size(weighted(images, difference));
  for (int m = 0; m < 6; ++m) {
    for (int i = 0; i < QJ_WIDTH; ++i) changes[i] = row_change[nodes[i] + m - 2];
    change = fma(fabs(six[m]), lane_load(changes, 0), change);
  }
  lane l = lane_of(settling.level);
  qlane q = block_point(point_numbers(numbers, g), block, 1, map[QJ_MAP_SLICE]);
#ifdef QJ_MODULUS_IS_CHEAP
  r.f = kind_modulus(q, map, factors);
  lane off = lane_of(QJ_INTERPOLATION_ROUNDING);
  // The image is off by what U is, times its distance from the origin.
  lane image_off =
      QJ_POINT_MARGIN * change * lane_exp(map_steep(r.f, map)) * kind_modulus_slope(map);
#else
  lane off = QJ_POINT_MARGIN * change;
  // Where F is steeper, so is the image's distance, and with it what the image's F can be off.
  lane image_off = (1 + map[QJ_MAP_STEEPER]) * QJ_IMAGE_MARGIN * change;
#endif
  lane result = map_steep(short_of(r.f, off, l), map);
  ilane sure = isless(result, lane_of(settling.below)) | isgreater(result, lane_of(settling.above));
  result = lane_where(sure, result, l);
  lane outer = lane_of(fmin(map[QJ_MAP_LOG_ESCAPE], map[QJ_MAP_LOG_OUTER]));
  lane lowest = map_steep(r.f - off, map), highest = map_steep(r.f + off, map);
  ilane goes_on = isgreater(lowest, lane_of(map[QJ_MAP_LOG_INNER])) & isless(highest, outer);
  if (lane_any(goes_on)) {
    lane radius = lane_exp(map_steep(r.f, map));
    qlane image = q_scale(radius * lane_rsqrt(fmax(q_dot(r.u, r.u), lane_of(QJ_TINY))), r.u);
    lane found = map_steep(short_of(kind_modulus(image, map, factors), image_off, l), map);
    result = lane_where(goes_on & lane_not(sure), found, result);
  }
  ilane escapes = isgreater(map_log_radius(q), lane_of(map[QJ_MAP_LOG_ESCAPE] - (real)1e-4f));
  lane_store(lane_where(escapes, l, result), settled, g);
}
