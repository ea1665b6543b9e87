// Distance to the nearest triangle, and the generalised winding number, of given points. One
// work-item carries QJ_WIDTH neighbouring points through the hierarchy together: a node is opened
// when any of them needs it.

#include "lane_math.clh"
#include "layout/bvh.h"

// One vector a lane.
typedef struct {
  lane x, y, z;
} lane3;

static inline lane3 l3_minus(lane3 p, global const real* v) {
  lane3 d = {p.x - v[0], p.y - v[1], p.z - v[2]};
  return d;
}
static inline lane3 l3_from(global const real* v, lane3 p) {
  lane3 d = {v[0] - p.x, v[1] - p.y, v[2] - p.z};
  return d;
}
static inline lane l3_dot(lane3 a, lane3 b) { return fma(a.x, b.x, fma(a.y, b.y, a.z * b.z)); }
static inline lane l3_dot_real(lane3 a, real x, real y, real z) {
  return fma(a.x, lane_of(x), fma(a.y, lane_of(y), a.z * z));
}

static inline lane3 load_point(global const real* points, int stride, int g) {
  lane3 p = {lane_load(points, g), lane_load(points + stride, g),
             lane_load(points + 2 * stride, g)};
  return p;
}

// Squared distance to a box; 0 inside.
static inline lane squared_box_distance(lane3 p, global const real* node) {
  global const real* low = node + QJ_NODE_LOW;
  global const real* high = node + QJ_NODE_HIGH;
  lane3 d = {fmax(fmax(low[0] - p.x, p.x - high[0]), lane_of(0)),
             fmax(fmax(low[1] - p.y, p.y - high[1]), lane_of(0)),
             fmax(fmax(low[2] - p.z, p.z - high[2]), lane_of(0))};
  return l3_dot(d, d);
}

// Squared distance of v to the segment from the origin to e, where inverse = 1 / |e|^2.
static inline lane squared_segment_distance(lane3 v, real ex, real ey, real ez, real inverse) {
  lane t = clamp(l3_dot_real(v, ex, ey, ez) * inverse, lane_of(0), lane_of(1));
  lane3 d = {fma(-t, lane_of(ex), v.x), fma(-t, lane_of(ey), v.y), fma(-t, lane_of(ez), v.z)};
  return l3_dot(d, d);
}

// Squared distance to a triangle: to its plane where the point lies over its interior, else to the
// nearest edge.
static inline lane squared_triangle_distance(lane3 p, global const real* t) {
  lane3 v = l3_minus(p, t + QJ_TRIANGLE_A);
  real3 ab = vload3(0, t + QJ_TRIANGLE_AB);
  real3 ac = vload3(0, t + QJ_TRIANGLE_AC);
  real3 n = vload3(0, t + QJ_TRIANGLE_NORMAL);
  real3 bc = ac - ab;
  lane3 w = {v.x - ab.x, v.y - ab.y, v.z - ab.z};
  lane edges = fmin(fmin(squared_segment_distance(v, ab.x, ab.y, ab.z, t[QJ_TRIANGLE_AB2]),
                         squared_segment_distance(v, ac.x, ac.y, ac.z, t[QJ_TRIANGLE_AC2])),
                    squared_segment_distance(w, bc.x, bc.y, bc.z, t[QJ_TRIANGLE_BC2]));
  // In the plane, normal x edge points to the inner side of each edge.
  real3 inner_ab = cross(n, ab);
  real3 inner_bc = cross(n, bc);
  real3 inner_ca = cross(ac, n);
  lane side = fmin(fmin(l3_dot_real(v, inner_ab.x, inner_ab.y, inner_ab.z),
                        l3_dot_real(w, inner_bc.x, inner_bc.y, inner_bc.z)),
                   l3_dot_real(v, inner_ca.x, inner_ca.y, inner_ca.z));
  lane height = l3_dot_real(v, n.x, n.y, n.z);
  return lane_where(isgreater(side, lane_of(0)), height * height, edges);
}

// points: three arrays X, Y, Z of `stride` reals each (a multiple of QJ_WIDTH), neighbours in
// space side by side; one work-item per QJ_WIDTH points. distance: `stride` reals.
//
// Of two children that may hold the nearest triangle, the one nearer to the points on average is
// opened first. The other waits as a bit of `trail`, which has one for each level from the node up;
// parents' numbers lead back to it (Laine 2010, "Restart trail for stackless BVH traversal").
kernel void nearest_distance(global const real* points, int stride, int groups,
                             global const real* nodes, global const int* links,
                             global const real* triangles, global real* distance) {
  int g = (int)get_global_id(0);
  if (g >= groups) return;
  lane3 p = load_point(points, stride, g);
  lane best = lane_of(INFINITY);
  int n = 0;
  ulong trail = 0;
  for (;;) {
    global const int* link = links + n * QJ_NODE_INTS;
    int first = link[QJ_NODE_FIRST];
    int count = link[QJ_NODE_COUNT];
    for (int t = first; t < first + count; ++t) {
      best = fmin(best, squared_triangle_distance(p, triangles + t * QJ_TRIANGLE_REALS));
    }
    if (count == 0) {
      lane left = squared_box_distance(p, nodes + first * QJ_NODE_REALS);
      lane right = squared_box_distance(p, nodes + (first + 1) * QJ_NODE_REALS);
      int left_opens = lane_any(isless(left, best));
      int right_opens = lane_any(isless(right, best));
      if (left_opens | right_opens) {
        int left_first = left_opens && !(right_opens && lane_sum(right) <= lane_sum(left));
        n = first + 1 - left_first;
        trail = trail << 1 | (ulong)(left_opens & right_opens);
        continue;
      }
    }
    // On to the nearest node that waits and still may hold a nearer triangle.
    bool found = false;
    while (trail != 0 && !found) {
      while ((trail & 1) == 0) {
        n = links[n * QJ_NODE_INTS + QJ_NODE_PARENT];
        trail >>= 1;
      }
      trail ^= 1;
      n = QJ_NODE_SIBLING(n);
      found = lane_any(isless(squared_box_distance(p, nodes + n * QJ_NODE_REALS), best));
    }
    if (!found) break;
  }
  lane_store(sqrt(best), distance, g);
}

// Solid angle of a triangle seen from p, over 2 (van Oosterom and Strackee 1983).
static inline lane half_solid_angle(lane3 p, global const real* t) {
  lane3 a = l3_from(t + QJ_TRIANGLE_A, p);
  lane3 b = {a.x + t[QJ_TRIANGLE_AB], a.y + t[QJ_TRIANGLE_AB + 1], a.z + t[QJ_TRIANGLE_AB + 2]};
  lane3 c = {a.x + t[QJ_TRIANGLE_AC], a.y + t[QJ_TRIANGLE_AC + 1], a.z + t[QJ_TRIANGLE_AC + 2]};
  lane la = sqrt(l3_dot(a, a));
  lane lb = sqrt(l3_dot(b, b));
  lane lc = sqrt(l3_dot(c, c));
  // a . (b x c) = a . ((b - a) x (c - a)): the second cross product is the same for all points.
  real3 n = cross(vload3(0, t + QJ_TRIANGLE_AB), vload3(0, t + QJ_TRIANGLE_AC));
  lane volume = l3_dot_real(a, n.x, n.y, n.z);
  lane below = la * lb * lc + l3_dot(a, b) * lc + l3_dot(b, c) * la + l3_dot(c, a) * lb;
  return copysign(lane_angle(fabs(volume), below), volume);
}

// Arguments as above. winding: `stride` reals, about 1 inside and 0 outside.
kernel void winding_number(global const real* points, int stride, int groups,
                           global const real* nodes, global const int* links,
                           global const real* triangles, global real* winding) {
  int g = (int)get_global_id(0);
  if (g >= groups) return;
  lane3 p = load_point(points, stride, g);
  lane sum = lane_of(0);  // solid angle over 2
  int n = 0;
  while (n != QJ_NODE_NONE) {
    global const real* node = nodes + n * QJ_NODE_REALS;
    global const int* link = links + n * QJ_NODE_INTS;
    lane3 d = l3_from(node + QJ_NODE_CENTROID, p);
    lane square = l3_dot(d, d);
    if (lane_all(isgreater(square, lane_of(node[QJ_NODE_FAR])))) {
      global const real* normal = node + QJ_NODE_NORMAL;
      lane r = lane_rsqrt(square);
      sum += (real)0.5 * l3_dot_real(d, normal[0], normal[1], normal[2]) * r * r * r;
      n = link[QJ_NODE_NEXT];
      continue;
    }
    int first = link[QJ_NODE_FIRST];
    int count = link[QJ_NODE_COUNT];
    for (int t = first; t < first + count; ++t) {
      sum += half_solid_angle(p, triangles + t * QJ_TRIANGLE_REALS);
    }
    n = count == 0 ? first : link[QJ_NODE_NEXT];
  }
  lane_store(sum / (2 * QJ_PI), winding, g);
}
