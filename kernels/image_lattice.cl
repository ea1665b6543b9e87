// Which cells of a lattice of images interpolation serves well: those at whose middles, where it is
// worst, it gives F and U to within `allowed`. What it is off by there comes from fourth
// differences of the nodes around. Work-items are scalar, whatever the lane width.

#include "image_lattice.clh"

// A cubic polynomial through nodes -1 ... 2 is off by this times the fourth difference at 1 / 2.
#define QJ_MIDDLE_ERROR ((real)(3.0f / 128))

// How large the fourth difference of F and U is about a node along an axis. `at` is the node's
// index along it, of `count`, and `stride` the way from node to node. Negative if not all five
// nodes are stored.
static inline real fourth_difference(image_lattice lattice, int node, int at, int count,
                                     int stride) {
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
#ifdef QJ_MODULUS_IS_CHEAP
  return sqrt(dot(u, u));  // F itself is at hand
#else
  return fabs(f) + sqrt(dot(u, u));
#endif
}

// cells: numbers of `count` cells. trusted: by cell.
kernel void trust_cells(global const int* cells, int count, global const real* grid,
                        global const int* places, global const real* field,
                        global const real* versors, real allowed, global uchar* trusted) {
  int number = (int)get_global_id(0);
  if (number >= count) return;
  image_lattice lattice = {grid, places, field, versors, trusted};
  int low = cells[number], left = low, stride = 1;
  int opposite = low + 1 + (int)grid[QJ_GRID_POINTS] * (1 + (int)grid[QJ_GRID_POINTS + 1]);
  real squares = 0;
  bool is_known = true;
  for (int axis = 0; axis < 3; ++axis) {
    int nodes = (int)grid[QJ_GRID_POINTS + axis], at = left % nodes;
    // About both ends of the two edges that meet the lowest or the highest corner.
    real largest = fmax(fmax(fourth_difference(lattice, low, at, nodes, stride),
                             fourth_difference(lattice, low + stride, at + 1, nodes, stride)),
                        fmax(fourth_difference(lattice, opposite - stride, at, nodes, stride),
                             fourth_difference(lattice, opposite, at + 1, nodes, stride)));
    is_known = is_known && largest >= 0;
    squares = fma(largest, largest, squares);
    left /= nodes;
    stride *= nodes;
  }
  trusted[low] = is_known && QJ_MIDDLE_ERROR * sqrt(squares) <= allowed;
}
