// Where on the edges of a grid the set {F_n < L} ends.
//
// F_n jumps where orbits part, so its values at the two ends of an edge hardly show where between
// them the set ends. The sides of points between them do: a point is tried, the part of the edge
// whose ends lie on different sides is kept, and so on.
//
// An orbit also shows how far its start is from the set's boundary. If its m-th iterate decides it,
// and every iterate stretches distances by s, the distance is about
//   |F_m - L| / (|grad F_1| s^(m - 1)).
// The vertex divides what is left of an edge in the ratio of these distances at its ends. If the
// same iterate decides both ends, this is the linear interpolation of that iterate's F. The next
// point to try is found in the same way, and the search ends when a point is close enough to the
// boundary.

#include "layout/placement.h"
#include "map.clh"
#include "turns.clh"

// How many edges a work-item has under way. There are more of them than lanes, so that enough of
// them wait for the same function to fill the lanes. entry(i) is the index i into a list of them.
// With one edge it is 0, which compilers must see to keep the edge in registers.
#if QJ_WIDTH == 1
#define HELD 1
#define entry(i) (0 * (i))
#else
#define HELD (4 * QJ_WIDTH)
#define entry(i) (i)
#endif

// Differences from the level are clamped to this, because infinite ones cannot be interpolated.
#define LARGEST_DIFFERENCE ((real)100)

// The part of an edge on which the set ends. Places are in steps from the edge's first point.
typedef struct {
  int id;
  int axis;
  real x, y, z;  // the index of the first point
  real near, far;
  real at_near, at_far;     // differences from the level; exactly one is below 0
  int near_done, far_done;  // the iterates that decided them; 0 if these are not known
  real tried;               // the place whose orbit is run
  int tries;
} crossed_edge;

static inline crossed_edge new_edge(global const real* edges, int stride, int id) {
  crossed_edge e;
  e.id = id;
  e.x = edges[id], e.y = edges[stride + id], e.z = edges[2 * stride + id];
  e.axis = (int)edges[3 * stride + id];
  e.near = 0, e.far = 1;
  e.at_near = edges[4 * stride + id], e.at_far = edges[5 * stride + id];
  e.near_done = e.far_done = 0;
  e.tried = 0;
  e.tries = 0;
  return e;
}

// x / stretch^times.
static inline real shrunk(real x, int times, const qj_placement* p) {
  for (int i = 0; i < times; ++i) x /= p->stretch;
  return x;
}

// The place that divides what is left of the edge in the ratio of its ends' distances from the
// boundary.
static inline real divided(const crossed_edge* e, const qj_placement* p) {
  real near = e->at_near, far = e->at_far;
  if (e->near_done > 0 && e->far_done > 0) {
    near = shrunk(near, e->near_done - e->far_done, p);
    far = shrunk(far, e->far_done - e->near_done, p);
  } else {
    near = clamp(near, -p->reach, p->reach);
    far = clamp(far, -p->reach, p->reach);
  }
  return e->near + (e->far - e->near) * (near / (near - far));
}

// The place to try next. It is no nearer to an end than a quarter of what is left of the edge, so
// that each try makes that shorter.
static inline real next_place(const crossed_edge* e, const qj_placement* p) {
  real margin = (real)0.25 * (e->far - e->near);
  return clamp(divided(e, p), e->near + margin, e->far - margin);
}

static inline real3 point_on(const crossed_edge* e, real place, const qj_placement* p) {
  return (real3)(fma(e->x + (e->axis == 0 ? place : 0), p->step, p->origin_x),
                 fma(e->y + (e->axis == 1 ? place : 0), p->step, p->origin_y),
                 fma(e->z + (e->axis == 2 ? place : 0), p->step, p->origin_z));
}

// Keeps the part that holds the boundary. Iterate number `done` has decided the orbit of the point
// that was tried; a field that is NaN is outside.
static inline void shorten(crossed_edge* e, real field, real level, int done,
                           const qj_placement* p) {
  real over = field - level;
  bool inside = field < level;
  real difference =
      inside ? fmax(over, -LARGEST_DIFFERENCE) : fmin(p->flatten * over, LARGEST_DIFFERENCE);
  // There are no branches here: some compilers would turn them into a choice of addresses in
  // memory.
  bool to_near = inside == (e->at_near < 0);
  e->near = to_near ? e->tried : e->near, e->far = to_near ? e->far : e->tried;
  e->at_near = to_near ? difference : e->at_near, e->at_far = to_near ? e->at_far : difference;
  e->near_done = to_near ? done : e->near_done, e->far_done = to_near ? e->far_done : done;
  ++e->tries;
}

// The vertex's place once it is known well enough; below 0 until then.
static inline real known_place(const crossed_edge* e, const qj_placement* p) {
  if (p->slope > 0) {
    real from_near = shrunk(fabs(e->at_near) / p->slope, e->near_done - 1, p);
    if (e->near_done > 0 && from_near < p->close) return fmin(e->near + from_near, e->far);
    real from_far = shrunk(fabs(e->at_far) / p->slope, e->far_done - 1, p);
    if (e->far_done > 0 && from_far < p->close) return fmax(e->far - from_far, e->near);
  }
  return e->tries < p->tries ? -1 : divided(e, p);
}

// The edges that a work-item has under way, each in a slot with the orbit of the place it tries.
typedef struct {
  crossed_edge edge[HELD];
  int done[HELD];  // iterates of its orbit
  real x[HELD], y[HELD], z[HELD], w[HELD], f[HELD];
  int for_field[HELD], for_versor[HELD];  // the slots that wait for F, and for a versor
  int ended[HELD];                        // those whose orbits have ended
  int fields, versors, ends;              // how many
  int next_edge, last_edge;               // the edges that are left
} held_edges;

// What all edges have in common.
typedef struct {
  global const real* map;
  global const real* edges;
  global real* at;
  qj_placement placement;
} placing;

// Takes the edge in a slot on: to its vertex, and then to the next edge, where that is known; else
// to the next try, whose orbit waits for F.
static inline void take_edge_on(const placing* with, held_edges* held, int slot) {
  crossed_edge* e = &held->edge[slot];
  const qj_placement* p = &with->placement;
  for (;;) {
    real place = known_place(e, p);
    if (!(place < 0)) {  // also where it is NaN, which no further try would change
      with->at[e->id] = place;
      if (held->next_edge == held->last_edge) return;
      *e = new_edge(with->edges, p->stride, held->next_edge++);
      continue;
    }
    e->tried = next_place(e, p);
    real3 start = point_on(e, e->tried, p);
    held->x[slot] = start.x, held->y[slot] = start.y, held->z[slot] = start.z;
    held->w[slot] = with->map[QJ_MAP_SLICE];
    held->f[slot] = 0;
    held->done[slot] = 0;
    held->for_field[entry(held->fields)] = slot, ++held->fields;
    return;
  }
}

// edges: six arrays of placement.stride reals: the index (i, j, k) of an edge's first point, its
// axis, and the clamped differences from the level at its first and last point, of which exactly
// one is below 0. at: `stride` reals, the place of each vertex in steps from the first point.
//
// A work-item has `placement.share` edges, from item * placement.share on, of placement.count in
// all. A turn of its loop computes F, or the versor of an image, for edges that wait for it, as
// many as there are lanes. What is found on an edge does not depend on the other edges.
kernel void place_vertices(global const real* map, int factors, qj_placement placement,
                           global const real* edges, global real* at TURNS_ARGUMENT) {
  held_edges held;
  held.next_edge = (int)get_global_id(0) * placement.share;
  if (held.next_edge >= placement.count) return;
  held.last_edge = min(held.next_edge + placement.share, placement.count);
  held.fields = held.versors = held.ends = 0;
  placing with;
  with.map = map;
  with.edges = edges;
  with.at = at;
  with.placement = placement;
  real level = map[QJ_MAP_SURFACE_LEVEL], escape = map[QJ_MAP_LOG_ESCAPE];
  // An iterate whose F is not between these is the last.
  real below = map[QJ_MAP_LOG_INNER], above = fmin(escape, map[QJ_MAP_LOG_OUTER]);

  for (int slot = 0; slot < HELD && held.next_edge < held.last_edge; ++slot) {
    held.edge[slot] = new_edge(edges, placement.stride, held.next_edge++);
    held.ended[entry(held.ends)] = slot, ++held.ends;
  }
  for (;;) {
    while (held.ends > 0) {
      --held.ends;
      take_edge_on(&with, &held, entry(held.ended[entry(held.ends)]));
    }
    if (held.fields + held.versors == 0) return;
    bool is_field =
        held.versors < QJ_WIDTH && (held.fields >= QJ_WIDTH || held.fields >= held.versors);
    COUNT_TURN(is_field);
    int waiting = is_field ? held.fields : held.versors;
    int count = min(waiting, QJ_WIDTH);
    int slots[QJ_WIDTH];
    real px[QJ_WIDTH], py[QJ_WIDTH], pz[QJ_WIDTH], pw[QJ_WIDTH], pf[QJ_WIDTH];
    for (int i = 0; i < QJ_WIDTH; ++i) {
      int from = waiting - 1 - min(i, count - 1);
      int slot =
          is_field ? entry(held.for_field[entry(from)]) : entry(held.for_versor[entry(from)]);
      slots[i] = slot;
      px[i] = held.x[slot], py[i] = held.y[slot], pz[i] = held.z[slot], pw[i] = held.w[slot];
      pf[i] = held.f[slot];
    }
    qlane q = q_make(lane_load(px, 0), lane_load(py, 0), lane_load(pz, 0), lane_load(pw, 0));
    if (!is_field) {
      held.versors -= count;
      q = map_image(q, lane_load(pf, 0), map, factors);
      lane_store(q.x, px, 0), lane_store(q.y, py, 0), lane_store(q.z, pz, 0);
      lane_store(q.w, pw, 0);
      for (int i = 0; i < count; ++i) {
        int lane = entry(i), slot = entry(slots[lane]);
        held.x[slot] = px[lane], held.y[slot] = py[lane], held.z[slot] = pz[lane];
        held.w[slot] = pw[lane];
        held.for_field[entry(held.fields)] = slot, ++held.fields;
      }
      continue;
    }
    held.fields -= count;
    real radius[QJ_WIDTH];
    lane_store(map_modulus(q, map, factors), pf, 0);
    lane_store(map_log_radius(q), radius, 0);
    for (int i = 0; i < count; ++i) {
      int lane = entry(i), slot = entry(slots[lane]);
      // No iterate is run on a start beyond the escape radius.
      bool is_far = held.done[slot] == 0 && radius[lane] >= escape;
      held.f[slot] = is_far ? radius[lane] : pf[lane];
      ++held.done[slot];
      bool goes_on = held.f[slot] > below && held.f[slot] < above;
      if (!is_far && goes_on && held.done[slot] < placement.iterations) {
        held.for_versor[entry(held.versors)] = slot, ++held.versors;
        continue;
      }
      shorten(&held.edge[slot], held.f[slot], level, held.done[slot], &placement);
      held.ended[entry(held.ends)] = slot, ++held.ends;
    }
  }
}
