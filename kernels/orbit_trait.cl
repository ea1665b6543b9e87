// The value that colours a point of the set, averaged over a small ball about it as large as a
// pixel or a facet. To avoid grain, an iterate whose images of the ball are far apart is replaced
// by the mean over all its possible values.

#include "layout/picture_layout.h"
#include "map.clh"

#define TRAIT_CORNERS 4  // of a tetrahedron in the ball, run in turn
// The mean openness of an iterate of a point of the surface, where it is not resolved. On a fitted
// bunny, points that are resolved have as large a sum over six iterates as this gives.
#define TRAIT_MEAN_OPENNESS 0.7f

// 1 where images are close together, falling to 0 where they are apart: `square` is their mean
// square distance from their mean.
static inline lane trait_resolved(lane square) {
  lane t = clamp((square - (real)0.01) * (real)(1 / 0.07), lane_of(0), lane_of(1));
  return 1 - t * t * (3 - 2 * t);
}

static inline lane trait_mixed(lane mean, lane value, lane resolved) {
  return fma(resolved, value - mean, mean);
}

// The F between which orbits are undecided, and in between the surface's level.
typedef struct {
  real low, level, high;
} trait_band;

// Where a stop radius is not known or far away, as far as shells are thick.
static inline trait_band trait_band_of(global const real* map) {
  const real most = 2;
  trait_band band;
  band.level = map[QJ_MAP_SURFACE_LEVEL];
  real outer = fmin(map[QJ_MAP_LOG_ESCAPE], map[QJ_MAP_LOG_OUTER]);
  band.low = clamp(map[QJ_MAP_LOG_INNER], band.level - most, band.level - (real)1e-3f);
  band.high = clamp(outer, band.level + (real)1e-3f, band.level + most);
  return band;
}

// 1 at the surface's level, 0 where an orbit is decided.
static inline lane trait_openness(lane f, trait_band band) {
  lane below = (f - band.low) / (band.level - band.low);
  lane above = (band.high - f) / (band.high - band.level);
  return clamp(fmin(below, above), lane_of(0), lane_of(1));
}

// Means over the corners' images by an iterate.
typedef struct {
  lane angle;     // |X| / |q|
  lane openness;  // as above
  lane f;         // no farther than 1 from the band
  lane turned;    // mean square distances from the mean: of directions,
  lane risen;     // and of F, over the band's narrower side
} trait_images;

// Replaces the corners by their images.
static inline trait_images trait_iterate(global real* corners, int stride, int g,
                                         global const real* map, int factors, trait_band band) {
  lane angle = lane_of(0), openness = lane_of(0), f = lane_of(0), f2 = lane_of(0);
  qlane direction = q_make(angle, angle, angle, angle);
#pragma unroll 1
  for (int corner = 0; corner < TRAIT_CORNERS; ++corner) {
    global real* at = corners + (size_t)corner * 4 * stride;
    qlane q = q_load(at, stride, g);
    lane next = map_modulus(q, map, factors);
    q = map_image(q, next, map, factors);
    q_store(q, at, stride, g);
    qlane unit = q_scale(lane_rsqrt(fmax(q_dot(q, q), lane_of(QJ_TINY))), q);
    direction = q_add(direction, unit);
    angle += fmin(fabs(unit.x), lane_of(1));
    openness += trait_openness(next, band);
    next = clamp(next, lane_of(band.low - 1), lane_of(band.high + 1)) - band.level;
    f += next;
    f2 = fma(next, next, f2);
  }
  const real share = (real)1 / TRAIT_CORNERS;
  real narrow = fmin(band.level - band.low, band.high - band.level);
  trait_images found;
  found.angle = share * angle;
  found.openness = share * openness;
  found.f = fma(lane_of(share), f, lane_of(band.level));
  found.turned = 1 - share * share * q_dot(direction, direction);
  found.risen = fmax(share * f2 - share * share * f * f, lane_of(0)) / (narrow * narrow);
  return found;
}

// The mean of the lesser of `a` and the |X| of a direction that may be any: its probability
// density falls as the root of 1 - X^2. A polynomial, to 0.002.
static inline lane trait_mean_lesser(lane a) {
  return a * (1 + a * ((real)-0.6366 + a * ((real)-0.0292 + a * (real)0.0902)));
}

// How close the first one or two iterates come to the plane X = 0.
typedef struct {
  lane first, second;                    // |X| / |q| of the iterates
  lane first_resolved, second_resolved;  // how far they count
} trait_closeness;

static inline lane trait_closest(trait_closeness of, int iterations) {
  const real mean_of_one = (real)0.4244, mean_of_two = (real)0.2724;
  lane both =
      trait_mixed(trait_mean_lesser(of.first), fmin(of.first, of.second), of.second_resolved);
  bool is_one = iterations == 1;
  return trait_mixed(lane_of(is_one ? mean_of_one : mean_of_two), is_one ? of.first : both,
                     of.first_resolved);
}

// How far out of the grooves a point lies: 0 at the inner end of the undecided shell, 1 at the
// outer. It is resolved where F differs little over the whole shell, not over the narrower side as
// elsewhere: in exact maps that side is a tenth of the shell.
static inline lane trait_groove(trait_images first, trait_band band) {
  real wide = band.high - band.low;
  real narrow = fmin(band.level - band.low, band.high - band.level) / wide;
  lane share = clamp((first.f - band.low) / wide, lane_of(0), lane_of(1));
  real mean = (band.level - band.low) / wide;
  return trait_mixed(lane_of(mean), share, trait_resolved(narrow * narrow * first.risen));
}

// What the orbits of the corners tell: QJ_TRAIT_TRAP, QJ_TRAIT_GROOVE, or QJ_TRAIT_ITERATIONS, for
// how many iterates the orbit stays undecided, each counting the less the farther it is from the
// level.
static inline lane trait_of_orbits(global real* corners, int stride, int g, global const real* map,
                                   int factors, int iterations, int kind) {
  trait_band band = trait_band_of(map);
  int last =
      kind == QJ_TRAIT_ITERATIONS ? iterations : min(iterations, kind == QJ_TRAIT_TRAP ? 2 : 1);
  lane count = lane_of(0), open = lane_of(1), resolved = lane_of(1), groove = lane_of(0);
  trait_closeness closeness = {lane_of(0), lane_of(0), lane_of(0), lane_of(0)};
  int m = 0;
#pragma unroll 1
  for (; m < last && lane_any(isgreater(resolved * open, lane_of((real)1e-4f))); ++m) {
    trait_images images = trait_iterate(corners, stride, g, map, factors, band);
    open *= trait_mixed(lane_of((real)TRAIT_MEAN_OPENNESS), images.openness,
                        resolved * trait_resolved(images.risen));
    if (kind != QJ_TRAIT_ITERATIONS) open = lane_of(1);
    count += open;
    resolved *= trait_resolved(images.turned);
    if (m == 0) {
      groove = trait_groove(images, band);
      closeness.first = images.angle;
      closeness.first_resolved = resolved;
    } else if (m == 1) {
      closeness.second = images.angle;
      closeness.second_resolved = resolved;
    }
  }
  if (kind == QJ_TRAIT_TRAP) return trait_closest(closeness, iterations);
  if (kind == QJ_TRAIT_GROOVE) return groove;
  // The iterates left are not resolved: a geometric series.
  real left = 1 - exp2((real)(iterations - m) * log2((real)TRAIT_MEAN_OPENNESS));
  real series = (real)(TRAIT_MEAN_OPENNESS / (1 - TRAIT_MEAN_OPENNESS)) * left;
  return (count + series * open) / (real)iterations;
}

// |q - c|^2 from the centre of the k-th factor.
static inline lane trait_away(qlane q, global const real* map, int factors, int k) {
  qlane d = q_make(q.x - MAP_COMPONENT(map, factors, QJ_MAP_CENTER_X)[k],
                   q.y - MAP_COMPONENT(map, factors, QJ_MAP_CENTER_Y)[k],
                   q.z - MAP_COMPONENT(map, factors, QJ_MAP_CENTER_Z)[k],
                   q.w - MAP_COMPONENT(map, factors, QJ_MAP_CENTER_W)[k]);
  return fmax(q_dot(d, d), lane_of((real)1e-12f));
}

// Multiples of the golden ratio, so that numbers of neighbours in the list lie far apart: in the
// upper half for a root, in the lower for a pole.
static inline real trait_number(int k, real exponent) {
  real turns = (real)(k + 1) * (real)0.618034f, own = (real)0.5 * (turns - floor(turns));
  return exponent > 0 ? own + (real)0.5 : own;
}

// The number of the nearest factor. Where factors are about as near as each other, or closer
// together than the ball is wide, the mean of theirs.
static inline lane trait_factor(global const real* corners, int stride, int g,
                                global const real* map, int factors) {
  global const real* exponents = MAP_COMPONENT(map, factors, QJ_MAP_EXPONENT);
  qlane a = q_load(corners, stride, g), q = a;
#pragma unroll 1
  for (int corner = 1; corner < TRAIT_CORNERS; ++corner) {
    q = q_add(q, q_load(corners + (size_t)corner * 4 * stride, stride, g));
  }
  q = q_scale(lane_of((real)1 / TRAIT_CORNERS), q);
  qlane out = q_make(a.x - q.x, a.y - q.y, a.z - q.z, a.w - q.w);
  lane width = 2 * sqrt(q_dot(out, out)), nearest = lane_of((real)1e30f);
#pragma unroll 1
  for (int k = 0; k < factors; ++k) {
    lane away = trait_away(q, map, factors, k);
    if (exponents[k] != 0) nearest = fmin(nearest, away);
  }
  // The change from one to the next is as wide as the ball.
  lane sharpness = sqrt(nearest) / fmax(width, lane_of((real)1e-9f));
  lane log_nearest = lane_log2(nearest), sum = lane_of(0), weights = lane_of(0);
#pragma unroll 1
  for (int k = 0; k < factors; ++k) {
    if (exponents[k] == 0) continue;
    lane log_away = lane_log2(trait_away(q, map, factors, k));
    lane weight = exp2(fmax(sharpness * (log_nearest - log_away), lane_of(-60)));
    sum = fma(weight, lane_of(trait_number(k, exponents[k])), sum);
    weights += weight;
  }
  return sum / fmax(weights, lane_of(QJ_TINY));
}

// For each point, 0 ... 1. corners: four points in the ball, each with arrays X, Y, Z, W of
// `stride` reals, a multiple of QJ_WIDTH; images take their places. kind: one of QJ_TRAIT_....
// trait: `stride` reals.
kernel void orbit_trait(global real* corners, int stride, int groups, global const real* map,
                        int factors, int iterations, int kind, global real* trait) {
  int g = (int)get_global_id(0);
  if (g >= groups) return;
  lane found;
  if (kind == QJ_TRAIT_FACTOR) {
    found = trait_factor(corners, stride, g, map, factors);
  } else {
    found = trait_of_orbits(corners, stride, g, map, factors, iterations, kind);
  }
  lane_store(found, trait, g);
}
