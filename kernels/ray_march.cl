// First hits of rays with the iterated set {F_n < L}.
//
// Where F_1 >= ln r_out the next iterate escapes for certain, so F_1 alone tells that a point is
// outside, and how far the undecided band {F_1 < ln r_out} is at least: (F_1 - ln r_out) /
// max |grad F_1|. F_1 is smooth, so these safe steps are read from a grid. In the band, orbits are
// run. An orbit that escapes gives a safe step too: see `reach`.

#include "block_points.clh"
#include "grid.clh"
#include "image_lattice.clh"
#include "image_table.clh"
#include "layout/march.h"
#include "loose_places.clh"
#include "map.clh"
#include "turns.clh"
#include "view.clh"

// How far the band {F_1 < far_level} is, at least, from the points of these numbers of a grid; not
// above 0 in it. One work-item per QJ_WIDTH numbers, from `first_group` on; numbers: whole groups;
// safe: groups * QJ_WIDTH elements.
kernel void safe_steps(global const real* grid, global const int* numbers, int first_group,
                       int groups, global const real* map, int factors, int iterations,
                       real far_level, real steepest, global real* safe) {
  int g = (int)get_global_id(0);
  if (g >= groups) return;
  int nx = (int)grid[QJ_GRID_POINTS], ny = (int)grid[QJ_GRID_POINTS + 1];
  ilane index = point_numbers(numbers, first_group + g);
  ilane row = index / nx;
  real step = grid[QJ_GRID_STEP];
  lane x = fma(to_lane(index % nx), lane_of(step), lane_of(grid[QJ_GRID_ORIGIN]));
  lane y = fma(to_lane(row % ny), lane_of(step), lane_of(grid[QJ_GRID_ORIGIN + 1]));
  lane z = fma(to_lane(row / ny), lane_of(step), lane_of(grid[QJ_GRID_ORIGIN + 2]));
  qlane q = q_make(x, y, z, lane_of(map[QJ_MAP_SLICE]));
  lane_store(map_safe_step(q, map, factors, iterations, far_level, steepest, step), safe, g);
}

// What all rays of a launch have in common.
typedef struct {
  global const real* map;
  int factors;
  image_lattice lattice;
  image_table table;
  qj_march march;
  global const real* view;
  global const real* rays;
  int last_ray;  // after the work-item's own
  global real* depth;
  global const real* grid;
  global const real* safe;
  loose_places loose;
  real level, far_level, above, below;
  real near;  // nearer than this to the band the grid is too coarse, and orbits are run
} marching;

// How far the start of an orbit may move before the orbit comes into the band. With s = |grad F_1|
// in the band:
//
// - The point at which the last iterate's F_m is computed may move by (F_m - ln r_out) / s (see
//   kind_way). In a portal, where F_m is the logarithm of its image's radius, it may move by
//   (e^F_m - r_out) / scale.
// - If an iterate takes q to q', and q' may move by d, then q may move by d / scale in a portal.
//   Elsewhere, a move of q by t raises F by at most s t; and U turns about as fast as F rises, so
//   that q' moves by at most |q'| (e^(s t) - 1), which is below |q'| s t / ln 2 for s t <= ln 2. So
//   q may move by ln 2 / s min(1, d / |q'|).
// - R jumps where a portal, or its mask, ends: q may move as far as that.
//
// Where detail is painted, s is divided by the point's share.
typedef struct {
  real most;     // how far the start may move by the iterates before the last
  real per_way;  // how far the start may move for each unit that the last iterate's point may
} reach;

static inline reach whole_reach(void) {
  reach r = {(real)1e15f, 1};
  return r;
}

// The reach after one more iterate, of which reach_of_iterate gives `per_image` and `most`.
static inline reach reach_on(reach before, real per_image, real most) {
  reach r = {fmin(before.most, before.per_way * most),
             fmin(before.per_way * per_image, (real)1e15f)};
  return r;
}

static inline real way_of(reach before, real last) {
  return fmin(before.most, before.per_way * last);
}

// What an iterate with F = f at a point says about how far the point may move. `last`: if orbits
// end with this iterate. Else `per_image` times as far as its image may, and at most `most`.
typedef struct {
  lane last, per_image, most;
} iterate_reach;

static inline iterate_reach reach_of_iterate(qlane q, lane f, lane enlarged, lane jump,
                                             global const real* map, real far_level,
                                             real steepest) {
  lane shell = paint_share(q, map) / steepest;
  lane growth = lane_exp(lane_max(lane_min(f, lane_of((real)40)), lane_of((real)-40)));
  ilane in_portal = isgreater(enlarged, lane_of(0));
  lane per_scale = 1 / lane_where(in_portal, enlarged, lane_of(1));
  lane slow = lane_of(QJ_LN2) * shell;
  iterate_reach r;
  r.last = fmin(jump, lane_where(in_portal, (growth - exp(far_level)) * per_scale,
                                 kind_way((f - far_level) * shell, q, map)));
  r.per_image = lane_where(in_portal, per_scale, slow / growth);
  r.most = lane_where(in_portal, jump, fmin(jump, slow));
  return r;
}

// A ray on its way: depths along it.
typedef struct {
  real x, y;  // pixel coordinates
  real start, end;
  real t;
  real outside;  // the last depth known to be outside; below `start` where none is known
  real through;  // up to this depth the ray passes through what its hint lies in; 0: nothing
  real least;    // the least step now
  real back;     // how far a hint that lies inside is taken back
  int id;
  bool hit;  // is bisecting between `outside` and t
} marched_ray;

static inline marched_ray new_ray(const marching* with, global const real* rays, int id) {
  marched_ray r;
  r.id = id;
  r.x = rays[id], r.y = rays[with->march.stride + id];
  real3 direction, origin = view_point(with->view, r.x, r.y, 0, &direction);
  // The part of the ray inside the ball, then inside the box that is seen.
  real middle = -dot(origin, direction), radius = with->march.radius;
  real half2 = fma(middle, middle, radius * radius - dot(origin, origin));
  real half_chord = sqrt(fmax(half2, (real)0));
  r.start = fmax(middle - half_chord, (real)0);
  r.end = half2 > 0 ? middle + half_chord : r.start;
  // A ray along a face of the box runs inside or outside of it: neither bound is NaN.
  const real least = (real)1e-9f;
  real3 speed = select(direction, (real3)(least), isless(fabs(direction), (real3)(least)));
  real3 a = (real3_at(with->grid + QJ_GRID_SEEN_LOW) - origin) / speed;
  real3 b = (real3_at(with->grid + QJ_GRID_SEEN_HIGH) - origin) / speed;
  real3 in = fmin(a, b), out = fmax(a, b);
  r.start = fmax(r.start, fmax(in.x, fmax(in.y, in.z)));
  r.end = fmax(fmin(r.end, fmin(out.x, fmin(out.y, out.z))), r.start);
  r.t = fmax(rays[2 * with->march.stride + id], r.start);
  r.outside = r.t > r.start ? (real)-1 : r.start;
  r.through = rays[3 * with->march.stride + id];
  r.least = r.t > r.start ? with->march.first : with->march.shortest;
  r.back = 4 * r.least;
  r.hit = false;
  return r;
}

// The depth whose orbit is run.
static inline real probe_of(const marched_ray* r) {
  return r->hit ? (real)0.5 * (r->outside + r->t) : r->t;
}

// Takes safe steps up to the band; false where the ray ends before it.
static inline bool reaches_band(const marching* with, marched_ray* r) {
  real3 direction, origin = view_point(with->view, r->x, r->y, 0, &direction);
  real t = r->t;
  while (t < r->end) {
    real3 p = origin + t * direction;
    real step = grid_value(with->grid, with->safe, p.x, p.y, p.z);
    if (step < with->near) break;
    t += step;
  }
  if (t > r->t) r->outside = fmax(t - with->near, r->start);
  r->t = t;
  return t < r->end;
}

// The depth if all that is asked is whether there is a hit before it; 0 where the hit is asked for.
static inline real asked_until(const marching* with, const marched_ray* r) {
  return with->rays[4 * with->march.stride + r->id];
}

// Whether it is known that nothing is hit before that.
static inline bool is_free(const marching* with, const marched_ray* r) {
  real until = asked_until(with, r);
  return until > 0 && r->outside >= until;
}

// Whether an orbit ends with its iterate number `done`, of this F.
static inline bool ends(const marching* with, real f, int done) {
  return done >= with->march.iterations || f <= with->below || f >= with->above;
}

// Takes the result of the orbit at probe_of(r): it ended with F = f, and its start may move by
// `away` (see `reach`). True when the hit is known.
static inline bool is_found(const marching* with, marched_ray* r, real f, real away) {
  bool inside = f < with->level;
  real probe = probe_of(r), loose_way = 0;
  if (inside) {
    real3 direction, p = view_point(with->view, r->x, r->y, probe, &direction);
    loose_way = way_through_loose(&with->loose, p, direction, with->march.shortest);
    if (probe < r->through) loose_way = fmax(loose_way, with->march.shortest);
    inside = loose_way <= 0;
  } else {
    r->through = 0;  // it has come out
  }
  if (!inside) r->outside = probe;
  if (r->hit) {
    if (inside) r->t = probe;
  } else if (loose_way > 0) {
    r->t += loose_way;
  } else if (!inside) {
    r->t += fmax(fmin(away, with->grid[QJ_GRID_STEP]), r->least);
    r->least = fmin(2 * r->least, with->march.shortest);
  } else if (r->outside < r->start) {
    // A hint that lies inside is taken back.
    r->t = fmax(r->t - r->back, r->start);
    if (r->t <= r->start) r->outside = r->start;
    r->back *= 2;
  } else {
    r->hit = true;
  }
  return r->hit && (r->t - r->outside <= with->march.tolerance || r->t <= asked_until(with, r));
}

static inline real one_of(lane v) {
  real values[QJ_WIDTH];
  lane_store(v, values, 0);
  return values[0];
}

// What a lane waits for.
#define WAITS_FOR_RAY 0
#define WAITS_FOR_ORBIT 1
#define WAITS_FOR_F 2
#define WAITS_FOR_VERSOR 3

// A versor costs as much as five F. So lanes wait for one until so many do.
#define MANY_VERSORS ((5 * QJ_WIDTH + 7) / 8)

// The lanes of a work-item. Each has a ray, and the orbit at probe_of(ray).
typedef struct {
  marched_ray ray[QJ_WIDTH];
  int waits[QJ_WIDTH];
  int done[QJ_WIDTH];                                       // iterates of the orbit
  real x[QJ_WIDTH], y[QJ_WIDTH], z[QJ_WIDTH], w[QJ_WIDTH];  // the last iterate
  real f[QJ_WIDTH];                                         // F of the iterate before it, or of it
  reach so_far[QJ_WIDTH];
} marched_lanes;

static inline qlane last_iterates(const marched_lanes* lanes) {
  return q_make(lane_load(lanes->x, 0), lane_load(lanes->y, 0), lane_load(lanes->z, 0),
                lane_load(lanes->w, 0));
}

static inline void begin_orbit(const marching* with, marched_lanes* lanes, int i) {
  const marched_ray* r = &lanes->ray[i];
  real3 p = view_point(with->view, r->x, r->y, probe_of(r), 0);
  lanes->x[i] = p.x, lanes->y[i] = p.y, lanes->z[i] = p.z, lanes->w[i] = with->map[QJ_MAP_SLICE];
  lanes->done[i] = 0;
  lanes->so_far[i] = whole_reach();
  lanes->waits[i] = WAITS_FOR_F;
}

// The orbit ended with F = f; its start may move by `away`.
static inline void end_orbit(const marching* with, marched_lanes* lanes, int i, real f, real away) {
  marched_ray* r = &lanes->ray[i];
  bool found = is_found(with, r, f, away);
  if (found) with->depth[r->id] = (real)0.5 * (r->outside + r->t);
  lanes->waits[i] = found ? WAITS_FOR_RAY : WAITS_FOR_ORBIT;
}

// Goes on from an image of the lattice, of norm `growth` when its versor has norm 1.
static inline void take_image(marched_lanes* lanes, int i, real4 u, real growth) {
  u *= growth * rsqrt(dot(u, u));
  lanes->x[i] = u.x, lanes->y[i] = u.y, lanes->z[i] = u.z, lanes->w[i] = u.w;
}

#ifdef QJ_MODULUS_IS_CHEAP

// F is computed, and the lattice, of one level of first iterates, gives the versor alone.
static inline void predict_first_iterates(const marching* with, marched_lanes* lanes, int i) {
  (void)with, (void)lanes, (void)i;
}

static inline void predict_first_versor(const marching* with, marched_lanes* lanes, int i) {
  predicted_image image;
  if (lanes->waits[i] != WAITS_FOR_VERSOR || lanes->done[i] != 1) return;
  if (!lattice_image(with->lattice, (real3)(lanes->x[i], lanes->y[i], lanes->z[i]), &image)) return;
  take_image(lanes, i, image.u,
             one_of(lane_exp(lane_min(lane_of(lanes->f[i]), lane_of((real)40)))));
  lanes->waits[i] = WAITS_FOR_F;
}

#else

// What the iterates before the last of a composed image say of how far the start may move (see
// `reach`). `shrunk`: e^-(the sum of their F). Orbits that one of them ended lie outside at the
// last one as well; F of the others is not below ln r_in.
static inline reach reach_of_composed(const marching* with, int iterates, real shrunk) {
  reach r = {whole_reach().most, 1};
  if (iterates < 2) return r;
  for (int n = 1; n < iterates; ++n) r.per_way *= QJ_LN2 / with->march.steepest;
  r.per_way *= shrunk;
  r.most = r.per_way * exp(fmax(with->below, (real)-2));
  return r;
}

// Where the lattice tells the first iterates, the orbit ends there or goes on from their image.
static inline void predict_first_iterates(const marching* with, marched_lanes* lanes, int i) {
  real3 p = (real3)(lanes->x[i], lanes->y[i], lanes->z[i]);
  predicted_image image;
  if (!lattice_image(with->lattice, p, &image)) return;
  qlane start = q_make(lane_of(p.x), lane_of(p.y), lane_of(p.z), lane_of(lanes->w[i]));
  real last = one_of(map_bent(lane_of(image.f), start, with->map));
  reach before = reach_of_composed(with, image.iterates, sqrt(dot(image.u, image.u)));
  lanes->done[i] = image.iterates;
  iterate_reach of_last = reach_of_iterate(start, lane_of(last), lane_of(0), lane_of((real)1e15f),
                                           with->map, with->far_level, with->march.steepest);
  if (ends(with, last, image.iterates)) {
    end_orbit(with, lanes, i, last, way_of(before, one_of(of_last.last)));
    return;
  }
  lanes->so_far[i] = reach_on(before, one_of(of_last.per_image), one_of(of_last.most));
  take_image(lanes, i, image.u, one_of(lane_exp(lane_of(last))));
}

static inline void predict_first_versor(const marching* with, marched_lanes* lanes, int i) {
  (void)with, (void)lanes, (void)i;
}

#endif

// Runs the iterates of an orbit that are looked up in the table, as far as it goes. Of iterates for
// which the table is too coarse, it ends those that it is sure of.
static inline void follow_table(const marching* with, marched_lanes* lanes, int i) {
  while (lanes->waits[i] == WAITS_FOR_F && lanes->done[i] + 1 >= with->march.sided) {
    bool is_coarse = lanes->done[i] + 1 < with->march.tabled;
    table_place place =
        place_in_table(with->table, (real4)(lanes->x[i], lanes->y[i], lanes->z[i], lanes->w[i]));
    qlane q = q_make(lane_of(lanes->x[i]), lane_of(lanes->y[i]), lane_of(lanes->z[i]),
                     lane_of(lanes->w[i]));
    if (place.state == QJ_TABLE_INSIDE) {
      ++lanes->done[i];
      end_orbit(with, lanes, i, with->below - 1, 0);
      return;
    }
    real kinds =
        place.state < 0 ? table_bound(with->table, place) : table_field(with->table, place);
    real f = one_of(map_bent(lane_of(kinds), q, with->map));
    // Where the map's F is steeper than its kind's, so much more is it off.
    real margin = with->march.margin * (1 + with->map[QJ_MAP_STEEPER]);
    if (is_coarse && (place.state < 0 || (f > with->below - margin && f < with->above + margin))) {
      return;
    }
    ++lanes->done[i];
    iterate_reach step = reach_of_iterate(q, lane_of(f), lane_of(0), lane_of((real)1e15f),
                                          with->map, with->far_level, with->march.steepest);
    if (ends(with, f, lanes->done[i]) || place.state < 0) {
      end_orbit(with, lanes, i, f, way_of(lanes->so_far[i], one_of(step.last)));
      return;
    }
    lanes->so_far[i] = reach_on(lanes->so_far[i], one_of(step.per_image), one_of(step.most));
    take_image(lanes, i, table_versor(with->table, place), one_of(lane_exp(lane_of(f))));
  }
}

// Takes a lane on by what grid, lattice and table tell, until it waits for F or a versor. It has
// none to wait for when there are no more rays.
static inline void go_on(const marching* with, marched_lanes* lanes, int i, int* next_ray) {
  marched_ray* r = &lanes->ray[i];
  for (;;) {
    follow_table(with, lanes, i);
    if (lanes->waits[i] > WAITS_FOR_ORBIT) return;
    if (lanes->waits[i] == WAITS_FOR_RAY) {
      if (*next_ray >= with->last_ray) return;
      *r = new_ray(with, with->rays, (*next_ray)++);
    }
    if (is_free(with, r) || (!r->hit && !reaches_band(with, r))) {
      with->depth[r->id] = QJ_NO_HIT;
      lanes->waits[i] = WAITS_FOR_RAY;
      continue;
    }
    begin_orbit(with, lanes, i);
    predict_first_iterates(with, lanes, i);
  }
}

// The images of all lanes that wait for their versor; they wait for F then.
static inline void compute_images(const marching* with, marched_lanes* lanes) {
  QJ_INT flags[QJ_WIDTH];
  for (int i = 0; i < QJ_WIDTH; ++i) {
    flags[i] = -(QJ_INT)(lanes->waits[i] == WAITS_FOR_VERSOR);
    if (lanes->waits[i] == WAITS_FOR_VERSOR) lanes->waits[i] = WAITS_FOR_F;
  }
  qlane q = last_iterates(lanes);
  q = q_where((ilane)(lane_load(flags, 0)),
              map_image(q, lane_load(lanes->f, 0), with->map, with->factors), q);
  lane_store(q.x, lanes->x, 0), lane_store(q.y, lanes->y, 0);
  lane_store(q.z, lanes->z, 0), lane_store(q.w, lanes->w, 0);
}

// F of all lanes that wait for it, which end their orbits or wait for the versor then.
static inline void compute_fields(const marching* with, marched_lanes* lanes) {
  real next[QJ_WIDTH], last[QJ_WIDTH], per_image[QJ_WIDTH], most[QJ_WIDTH];
  lane enlarged, jump;
  qlane q = last_iterates(lanes);
  lane value =
      map_modulus_and_jumps(q, with->map, with->factors, with->march.steepest, &enlarged, &jump);
  iterate_reach step =
      reach_of_iterate(q, value, enlarged, jump, with->map, with->far_level, with->march.steepest);
  lane_store(value, next, 0), lane_store(step.last, last, 0);
  lane_store(step.per_image, per_image, 0), lane_store(step.most, most, 0);
  for (int i = 0; i < QJ_WIDTH; ++i) {
    if (lanes->waits[i] != WAITS_FOR_F) continue;
    lanes->f[i] = next[i];
    ++lanes->done[i];
    if (ends(with, next[i], lanes->done[i])) {
      end_orbit(with, lanes, i, next[i], way_of(lanes->so_far[i], last[i]));
    } else {
      lanes->waits[i] = WAITS_FOR_VERSOR;
      lanes->so_far[i] = reach_on(lanes->so_far[i], per_image[i], most[i]);
      predict_first_versor(with, lanes, i);
    }
  }
}

// Depths along rays of a view. rays: five arrays of march.stride reals, the pixel coordinates x and
// y of each ray; a hint, which is a depth just in front of its hit, or 0; a depth up to which the
// ray passes through what its hint lies in, or 0; and a depth, if all that is asked is whether
// there is a hit before it, or 0. Such a ray's depth is any before that one, or QJ_NO_HIT. After a
// hint, steps double from march.first on, up to march.shortest. grid, safe: as in `safe_steps`.
// nodes, node_places, node_field, node_versors, trusted: a lattice of images. table_layout ...
// table_versors: a table of images (image_table.clh), for iterates from march.tabled on. loose_grid
// ... finer_bits: the places that rays pass through (loose_places.clh).
//
// A work-item has the rays item * march.share ... of march.count. Its lanes go each its own way: on
// by what grid and lattice tell, until an orbit needs F, or a versor, of a point; a turn of the
// loop computes one of them for all lanes that wait for it. What a ray finds does not depend on its
// companions.
kernel void march_depth(global const real* map, int factors, qj_march march,
                        global const real* view, global const real* rays, global const real* grid,
                        global const real* safe, global const real* nodes,
                        global const int* node_places, global const real* node_field,
                        global const real* node_versors, global const uchar* trusted,
                        global const real* table_layout, global const int* table_bricks,
                        global const ushort* table_fields, global const char* table_versors,
                        global const real* loose_grid, global const uint* loose_bits,
                        global const uint* finer_cells, global const uint* finer_bits,
                        global real* depth TURNS_ARGUMENT) {
  int next_ray = (int)get_global_id(0) * march.share;
  if (next_ray >= march.count) return;
  image_lattice lattice = {nodes, node_places, node_field, node_versors, trusted, 0};
  image_table table = {table_layout, table_bricks, table_fields, table_versors};
  marching with;
  with.map = map;
  with.factors = factors;
  with.lattice = lattice;
  with.table = table;
  with.march = march;
  with.view = view;
  with.rays = rays;
  with.last_ray = min(next_ray + march.share, march.count);
  with.depth = depth;
  with.grid = grid;
  with.safe = safe;
  with.loose.grid = loose_grid;
  with.loose.bits = loose_bits;
  with.loose.finer = march.finer;
  with.loose.finer_cells = finer_cells;
  with.loose.finer_bits = finer_bits;
  with.level = map[QJ_MAP_SURFACE_LEVEL];
  with.above = fmin(map[QJ_MAP_LOG_ESCAPE], map[QJ_MAP_LOG_OUTER]);
  with.below = map[QJ_MAP_LOG_INNER];
  // One iterate decides every point by itself.
  with.far_level = march.iterations == 1 ? with.level : with.above;
  with.near = (real)0.25 * grid[QJ_GRID_STEP];

  marched_lanes lanes;
  for (int i = 0; i < QJ_WIDTH; ++i) {
    lanes.waits[i] = WAITS_FOR_RAY;
    lanes.x[i] = lanes.y[i] = lanes.z[i] = lanes.w[i] = lanes.f[i] = 0;
    lanes.so_far[i] = whole_reach();
  }
  for (;;) {
    int fields = 0, versors = 0;
    for (int i = 0; i < QJ_WIDTH; ++i) {
      go_on(&with, &lanes, i, &next_ray);
      fields += lanes.waits[i] == WAITS_FOR_F;
      versors += lanes.waits[i] == WAITS_FOR_VERSOR;
    }
    if (fields + versors == 0) return;
    COUNT_TURN(!(fields == 0 || versors >= MANY_VERSORS));
    if (fields == 0 || versors >= MANY_VERSORS) {
      compute_images(&with, &lanes);
    } else {
      compute_fields(&with, &lanes);
    }
  }
}
