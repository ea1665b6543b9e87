// What a lattice of images consists of: F and U at its nodes, and the cells that interpolation
// serves well.

#include "block_points.clh"
#include "image_lattice.clh"

// Where orbits are before a level's own iterates.
typedef struct {
  ilane done;    // iterates
  qlane q;       // the last of them, or where the orbit begins
  lane log_sum;  // of F
} orbit_starts;

// The images that the levels after the first `reals` tell of points of the slice.
static inline orbit_starts predicted_starts(image_lattice lattice, int reals, qlane points,
                                            global const real* map) {
  real x[QJ_WIDTH], y[QJ_WIDTH], z[QJ_WIDTH], w[QJ_WIDTH], sum[QJ_WIDTH];
  QJ_INT done[QJ_WIDTH];
  lane_store(points.x, x, 0);
  lane_store(points.y, y, 0);
  lane_store(points.z, z, 0);
  lane_store(points.w, w, 0);
  for (int i = 0; i < QJ_WIDTH; ++i) {
    predicted_image image;
    done[i] = 0, sum[i] = 0;
    if (!image_by_levels(lattice, reals, (real3)(x[i], y[i], z[i]), &image)) continue;
    real values[QJ_WIDTH];
    qlane start = q_make(lane_of(x[i]), lane_of(y[i]), lane_of(z[i]), lane_of(w[i]));
    lane_store(lane_min(map_bent(lane_of(image.f), start, map), lane_of((real)40)), values, 0);
    real4 u = image.u * rsqrt(dot(image.u, image.u));
    real size = exp(values[0]);
    done[i] = image.iterates;
    sum[i] = values[0] - (image.iterates > 1 ? (real)0.5 * log(dot(image.u, image.u)) : 0);
    x[i] = size * u.x, y[i] = size * u.y, z[i] = size * u.z, w[i] = size * u.w;
  }
  orbit_starts starts;
  starts.done = lane_load(done, 0);
  starts.q = q_make(lane_load(x, 0), lane_load(y, 0), lane_load(z, 0), lane_load(w, 0));
  starts.log_sum = lane_load(sum, 0);
  return starts;
}

// Images of the nodes of these numbers of a level, which is described after so many reals: as
// numbers slots[i] among `field`, and four reals each among `versors` (image_lattice.clh). Images
// that the levels after it tell are not computed. Orbits go on past iterates that decide their
// side: beyond r_out the next iterate is farther out, and within r_in no iterate leaves, so that F
// of the last iterate tells the side too.
kernel void composed_images(global const int* numbers, global const int* slots,
                            global const real* levels, int reals, global const int* places,
                            global const uchar* trusted, int first_group, int groups,
                            global const real* map, int factors, global real* field,
                            global real* versors) {
  int item = (int)get_global_id(0);
  if (item >= groups) return;
  int g = first_group + item;
  global const real* level = levels + reals;
  int iterates = (int)level[QJ_LEVEL_ITERATES];
  int nx = (int)level[QJ_GRID_POINTS], ny = (int)level[QJ_GRID_POINTS + 1];
  ilane index = point_numbers(numbers, g);
  ilane row = index / nx;
  ilane layer = row / ny;
  lane h = lane_of(level[QJ_GRID_STEP]);
  global const real* origin = level + QJ_GRID_ORIGIN;
  lane a = fma(to_lane(index - row * nx), h, lane_of(origin[0]));
  lane b = fma(to_lane(row - layer * ny), h, lane_of(origin[1]));
  lane c = fma(to_lane(layer), h, lane_of(origin[2]));
  global const real* axes = level + QJ_LEVEL_AXES;
  orbit_starts orbits;
  orbits.q = q_make(fma(lane_of(axes[0]), a, fma(lane_of(axes[3]), b, axes[6] * c)),
                    fma(lane_of(axes[1]), a, fma(lane_of(axes[4]), b, axes[7] * c)),
                    fma(lane_of(axes[2]), a, fma(lane_of(axes[5]), b, axes[8] * c)),
                    lane_of(map[QJ_MAP_SLICE]));
  orbits.done = (ilane)(0);
  orbits.log_sum = lane_of(0);
  if (level[QJ_LEVEL_FOLLOWED] != 0) {
    image_lattice lattice = {levels, places, field, versors, trusted, 0};
    orbits = predicted_starts(lattice, reals + QJ_LEVEL_SIZE, orbits.q, map);
  }
  qlane u = orbits.q;
  lane last = lane_of(0);
  for (int n = 1;; ++n) {
    ilane runs = orbits.done < n;
    if (lane_any(runs)) {
      last = kind_step(orbits.q, map, factors, &u);
      if (n < iterates) {
        lane bent = lane_min(map_bent(last, orbits.q, map), lane_of((real)40));
        orbits.log_sum = lane_where(runs, orbits.log_sum + bent, orbits.log_sum);
        orbits.q = q_where(runs, q_scale(lane_exp(bent), u), orbits.q);
      }
    }
    if (n >= iterates) break;
  }
  if (iterates > 1) u = q_scale(lane_exp(lane_max(-orbits.log_sum, lane_of((real)-40))), u);
  real f[QJ_WIDTH], x[QJ_WIDTH], y[QJ_WIDTH], z[QJ_WIDTH], w[QJ_WIDTH];
  lane_store(last, f, 0);
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

// A cubic polynomial through nodes -1 ... 2 is off by this times the fourth difference at 1 / 2.
#define QJ_MIDDLE_ERROR ((real)(3.0f / 128))

// How much F and U differ by, when F and versors of the length `size` do by these.
static inline real image_change(real f, real4 u, real size) {
#ifdef QJ_MODULUS_IS_CHEAP
  (void)f;
  return sqrt(dot(u, u)) / size;  // F itself is at hand
#else
  return fabs(f) + sqrt(dot(u, u)) / size;
#endif
}

// How large the fourth difference of F and U is about a node along an axis. `at` is the node's
// index along it, of `count`, and `stride` the way from node to node. Negative if not all five
// nodes are stored.
static inline real fourth_difference(image_lattice lattice, int node, int at, int count, int stride,
                                     real size) {
  if (at < 2 || at + 2 >= count) return -1;
  real f = 0;
  real4 u = (real4)(0);
  const real weights[5] = {1, -4, 6, -4, 1};
  for (int m = 0; m < 5; ++m) {
    uint other = (uint)(node + (m - 2) * stride);
    if (!is_node_stored(lattice, other)) return -1;
    int place = node_place(lattice, other);
    f = fma(weights[m], lattice.field[place], f);
    u += weights[m] * vload4((size_t)place, lattice.versors);
  }
  return image_change(f, u, size);
}

// Marks the cells of a level (its `reals` after the first) at whose middles, where it is worst,
// interpolation gives F and U to within `allowed`, or to within `allowed_move` times what they
// change by from a node to the next. What it is off by there comes from fourth differences of the
// nodes around. cells: numbers of `count` cells. Work-items are scalar, whatever
// the lane width.
kernel void trust_cells(global const int* cells, int count, global const real* levels, int reals,
                        global const int* places, global const real* field,
                        global const real* versors, real allowed, real allowed_move,
                        global uchar* trusted) {
  int number = (int)get_global_id(0);
  if (number >= count) return;
  image_lattice all = {levels, places, field, versors, trusted, 0};
  image_lattice lattice = lattice_level(all, reals);
  global const real* grid = lattice.grid;
  int low = cells[number], left = low, stride = 1;
  int opposite = low + 1 + (int)grid[QJ_GRID_POINTS] * (1 + (int)grid[QJ_GRID_POINTS + 1]);
  int place = node_place(lattice, (uint)low);
  real4 u = vload4((size_t)place, versors);
  real size = grid[QJ_LEVEL_ITERATES] == 1 ? 1 : sqrt(dot(u, u));
  real squares = 0, moves = 0;
  bool is_known = true;
  for (int axis = 0; axis < 3; ++axis) {
    int nodes = (int)grid[QJ_GRID_POINTS + axis], at = left % nodes;
    // About both ends of the two edges that meet the lowest or the highest corner.
    real largest = fmax(fmax(fourth_difference(lattice, low, at, nodes, stride, size),
                             fourth_difference(lattice, low + stride, at + 1, nodes, stride, size)),
                        fmax(fourth_difference(lattice, opposite - stride, at, nodes, stride, size),
                             fourth_difference(lattice, opposite, at + 1, nodes, stride, size)));
    is_known = is_known && largest >= 0;
    squares = fma(largest, largest, squares);
    if (is_known) {
      int next = node_place(lattice, (uint)(low + stride));
      real move = image_change(field[next] - field[place], vload4((size_t)next, versors) - u, size);
      moves = fma(move, move, moves);
    }
    left /= nodes;
    stride *= nodes;
  }
  real most = fmax(allowed, allowed_move * sqrt(moves));
  trusted[trust_of_cell(lattice, (uint)low)] = is_known && QJ_MIDDLE_ERROR * sqrt(squares) <= most;
}
