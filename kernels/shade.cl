// From depths to light, in passes: normals, what receives light, the light it receives. The sky is
// many lights, each with a depth map of the shape seen along it; lamps are lights, too, with
// penumbras. Work-items are scalar, whatever the lane width.

#include "ground.clh"
#include "matter.clh"
#include "view.clh"

static inline void put_real3(global real* at, real3 v) {
  at[0] = v.x;
  at[1] = v.y;
  at[2] = v.z;
}

// Unit normals, towards the viewer, of the depth surface: a plane of depths fitted to the 5 x 5
// samples around, those at other depths counting less. depth, normal: the rows of the view from
// `first_row` on. softness: difference of depth at which the weight is a half.
kernel void normals_of_depth(global const real* view, int columns, int first_row, int rows,
                             global const real* depth, real softness, global real* normal) {
  int column = (int)get_global_id(0), row = (int)get_global_id(1);
  if (column >= columns || row >= rows) return;
  int index = row * columns + column;
  real t = depth[index];
  if (t < 0) return;
  real w = 0, wx = 0, wy = 0, wd = 0, wxx = 0, wxy = 0, wyy = 0, wxd = 0, wyd = 0;
  for (int j = max(row - 2, 0); j <= min(row + 2, rows - 1); ++j) {
    for (int i = max(column - 2, 0); i <= min(column + 2, columns - 1); ++i) {
      real d = depth[j * columns + i];
      if (d < 0) continue;
      d -= t;
      real x = (real)(i - column), y = (real)(j - row), r = d / softness;
      real c = 1 / ((1 + r * r) * (1 + (real)0.25 * (x * x + y * y)));
      w += c, wx += c * x, wy += c * y, wd += c * d;
      wxx += c * x * x, wxy += c * x * y, wyy += c * y * y, wxd += c * x * d, wyd += c * y * d;
    }
  }
  wxx -= wx * wx / w, wxy -= wx * wy / w, wyy -= wy * wy / w;
  wxd -= wx * wd / w, wyd -= wy * wd / w;
  real x = (real)column + (real)0.5, y = (real)(row + first_row) + (real)0.5;
  real3 direction;
  view_point(view, x, y, t, &direction);
  real3 n = -direction;
  real det = wxx * wyy - wxy * wxy;
  if (det > (real)1e-3f * w * w) {
    real gx = (wxd * wyy - wyd * wxy) / det, gy = (wyd * wxx - wxd * wxy) / det;
    real3 px = view_point(view, x + 1, y, t + gx, 0) - view_point(view, x - 1, y, t - gx, 0);
    real3 py = view_point(view, x, y + 1, t + gy, 0) - view_point(view, x, y - 1, t - gy, 0);
    n = normalize(cross(px, py));
    if (dot(n, direction) > 0) n = -n;
  }
  put_real3(normal + 3 * index, n);
}

// How far (column, row) of a light's depth map lies before `depth`: above 0 where it is a blocker.
static inline real before(global const real* map, int size, int column, int row, real depth) {
  if (column < 0 || row < 0 || column >= size || row >= size) return -1;
  real d = map[row * size + column];
  return d < 0 ? (real)-1 : depth - d;
}

// The light's share that reaches a point, filtered over the four texels around.
static inline real seen_hard(global const real* map, int size, real2 texel, real depth) {
  real2 corner = floor(texel - (real)0.5), f = texel - (real)0.5 - corner;
  int x = (int)corner.x, y = (int)corner.y;
  real a = before(map, size, x, y, depth) > 0, b = before(map, size, x + 1, y, depth) > 0;
  real c = before(map, size, x, y + 1, depth) > 0, d = before(map, size, x + 1, y + 1, depth) > 0;
  return 1 - mix(mix(a, b, f.x), mix(c, d, f.x), f.y);
}

#define MOST_PENUMBRA 24  // texels

// v turned by a golden angle. Points i of n at sqrt((i + 1/2) / n) along directions that turn so
// from one to the next lie evenly in the unit disc, and no row of them runs along an edge of a
// shadow.
static inline real2 golden_turn(real2 v) {
  const real c = (real)-0.737368878, s = (real)0.675490294;
  return (real2)(v.x * c - v.y * s, v.x * s + v.y * c);
}

// The share of the light that reaches a point, with a penumbra as wide as the blockers' mean
// distance makes it, but no narrower than `least`. The samples of a pixel begin with different
// directions, so that their taps complement each other.
static inline real seen_soft(global const real* map, int size, real2 texel, real depth,
                             real softness, real least, real2 direction) {
  const int searched = 32;
  real sum = 0, blockers = 0;
#pragma unroll 1
  for (int i = 0; i < searched; ++i) {
    real away = MOST_PENUMBRA * sqrt(((real)i + (real)0.5) / searched);
    real2 p = floor(texel + away * direction);
    direction = golden_turn(direction);
    real d = before(map, size, (int)p.x, (int)p.y, depth);
    if (d > 0 && d * softness > away) sum += d, blockers += 1;
  }
  const real step = blockers > 0 ? (real)0.025 : (real)0.0833333333;  // 40 taps, or 12
  real radius = least;
  if (blockers > 0) radius = clamp(sum / blockers * softness, least, (real)MOST_PENUMBRA);
  real lit = 0;
#pragma unroll 1
  for (real r2 = (real)0.5 * step; r2 < 1; r2 += step) {
    lit += (1 - r2) * seen_hard(map, size, texel + radius * sqrt(r2) * direction, depth);
    direction = golden_turn(direction);
  }
  return lit * 2 * step;  // the weights' sum is half the taps
}

// Whether and where light falls on a point, as a light's depth map sees it.
typedef struct {
  real cosine;
  real2 texel;
  real depth;
} light_sight;

static inline light_sight sight_of(real3 p, real3 n, global const real* restrict light) {
  light_sight s;
  real3 l = real3_at(light + QJ_LIGHT_DIRECTION);
  s.cosine = dot(n, l);
  // Off the surface and towards the light by as much as the depth map is coarse, so that it does
  // not shade itself; but not far off, into the other wall of a groove.
  real bias = light[QJ_LIGHT_TEXEL];
  real slope = fmin(sqrt(1 - fmin(s.cosine * s.cosine, (real)1)) / s.cosine, (real)2);
  real3 q = p + ((real)0.5 * bias) * n + (((real)0.5 + slope) * bias) * l;
  s.texel = (real2)(dot(q, real3_at(light + QJ_LIGHT_U)) + light[QJ_LIGHT_U + 3],
                    dot(q, real3_at(light + QJ_LIGHT_V)) + light[QJ_LIGHT_V + 3]);
  s.depth = dot(q, real3_at(light + QJ_LIGHT_DEPTH)) + light[QJ_LIGHT_DEPTH + 3];
  return s;
}

// Light falls on receivers: first the samples of a strip, row by row, then one point of the ground
// for each pixel. Each has QJ_RECEIVER_SIZE reals; a normal of zero receives nothing.

// Work-item (i, j): sample i of row j of the strip's.
kernel void sample_receivers(qj_strip_arguments strip, global const real* restrict view,
                             global const real* restrict depth, global const real* restrict normal,
                             global real* restrict receivers) {
  int i = (int)get_global_id(0), j = (int)get_global_id(1);
  int wide = strip.columns * strip.samples;
  if (i >= wide || j >= strip.rows * strip.samples) return;
  int index = (j + strip.halo) * wide + i;
  real t = depth[index];
  real3 direction;
  real3 p = view_point(view, (real)i + (real)0.5,
                       (real)(j + strip.first_row * strip.samples) + (real)0.5, t, &direction);
  real3 n = t >= 0 ? real3_at(normal + 3 * index) : (real3)(0);
  global real* receiver = receivers + (size_t)(j * wide + i) * QJ_RECEIVER_SIZE;
  put_real3(receiver + QJ_RECEIVER_POINT, p);
  put_real3(receiver + QJ_RECEIVER_NORMAL, n);
}

// Work-item (column, row): a pixel. Its ground is smooth: one point will do, where any sample of
// the pixel misses the shape.
kernel void ground_receivers(qj_strip_arguments strip, global const real* restrict view,
                             global const real* restrict depth, global const real* restrict scene,
                             global real* restrict receivers) {
  int column = (int)get_global_id(0), row = (int)get_global_id(1);
  if (column >= strip.columns || row >= strip.rows) return;
  int wide = strip.columns * strip.samples;
  bool missed = false;
  for (int s = 0; s < strip.samples * strip.samples; ++s) {
    int i = column * strip.samples + s % strip.samples;
    int j = row * strip.samples + s / strip.samples + strip.halo;
    missed |= depth[j * wide + i] < 0;
  }
  real3 origin, direction, p;
  real away;
  origin =
      view_point(view, ((real)column + (real)0.5) * (real)strip.samples,
                 ((real)(row + strip.first_row) + (real)0.5) * (real)strip.samples, 0, &direction);
  bool lit = missed && ground_point(origin, direction, scene, &p, &away);
  int number = wide * strip.rows * strip.samples + row * strip.columns + column;
  global real* receiver = receivers + (size_t)number * QJ_RECEIVER_SIZE;
  put_real3(receiver + QJ_RECEIVER_POINT, lit ? p : origin);
  put_real3(receiver + QJ_RECEIVER_NORMAL, lit ? real3_at(scene + QJ_SCENE_UP) : (real3)(0));
}

// What the sky sends to the receivers before the ground's, and what it would send with nothing in
// the way.
kernel void sky_light(qj_light_arguments with, global const real* restrict receivers,
                      global const real* restrict lights, global const real* restrict maps,
                      global real* restrict light) {
  int r = (int)get_global_id(0);
  if (r >= with.ground) return;
  real3 p = real3_at(receivers + (size_t)r * QJ_RECEIVER_SIZE + QJ_RECEIVER_POINT);
  real3 n = real3_at(receivers + (size_t)r * QJ_RECEIVER_SIZE + QJ_RECEIVER_NORMAL);
  int count = dot(n, n) == 0 ? 0 : with.lights;
  real3 sky = (real3)(0), open_sky = (real3)(0);
  for (int i = with.lamps; i < count; ++i) {
    global const real* from = lights + i * QJ_LIGHT_SIZE;
    if (dot(n, real3_at(from + QJ_LIGHT_DIRECTION)) <= 0) continue;
    light_sight s = sight_of(p, n, from);
    real3 open = s.cosine * real3_at(from + QJ_LIGHT_COLOR);
    sky += seen_hard(maps + (int)from[QJ_LIGHT_MAP_FIRST], (int)from[QJ_LIGHT_MAP_SIZE], s.texel,
                     s.depth) *
           open;
    open_sky += open;
  }
  put_real3(light + (size_t)r * QJ_RECEIVED_SIZE + QJ_RECEIVED_SKY, sky);
  put_real3(light + (size_t)r * QJ_RECEIVED_SIZE + QJ_RECEIVED_OPEN_SKY, open_sky);
}

// The share of the sky's light that reaches each receiver, points of the ground, with the shadows
// of lights as soft as they say.
kernel void ground_sky(qj_light_arguments with, global const real* restrict receivers,
                       global const real* restrict lights, global const real* restrict maps,
                       global real* restrict share) {
  int r = (int)get_global_id(0);
  if (r >= with.receivers) return;
  real3 p = real3_at(receivers + (size_t)r * QJ_RECEIVER_SIZE + QJ_RECEIVER_POINT);
  real3 n = real3_at(receivers + (size_t)r * QJ_RECEIVER_SIZE + QJ_RECEIVER_NORMAL);
  real sum = 0, open_sum = 0;
  for (int i = 0; i < with.lights; ++i) {
    global const real* from = lights + i * QJ_LIGHT_SIZE;
    if (dot(n, real3_at(from + QJ_LIGHT_DIRECTION)) <= 0) continue;
    light_sight s = sight_of(p, n, from);
    real open = s.cosine * luminance(real3_at(from + QJ_LIGHT_COLOR));
    real2 half_map = (real2)((real)0.5 * from[QJ_LIGHT_MAP_SIZE]);
    real2 beyond = fabs(s.texel - half_map) - half_map;
    open_sum += open;
    // No texel of the map is near enough.
    if (fmax(beyond.x, beyond.y) > MOST_PENUMBRA) {
      sum += open;
      continue;
    }
    sum += open * seen_soft(maps + (int)from[QJ_LIGHT_MAP_FIRST], (int)from[QJ_LIGHT_MAP_SIZE],
                            s.texel, s.depth, from[QJ_LIGHT_SOFTNESS] / from[QJ_LIGHT_TEXEL],
                            (real)1, (real2)(1, 0));
  }
  share[r] = sum / fmax(open_sum, (real)1e-6f);
}

// What the shape sends on of a lamp's light to a point, as irradiance by pi for a lamp of color 1:
// the sum over texels of the lamp's map, of area A across its rays, of
// A albedo (n w) (-m w) / (pi |w|^4), where w leads from the point to the texel, and n and m are
// the normals. Each level has the texels of a window about the point but those that finer levels
// have. Of each square of samples x samples texels this sums one, so many times; part: which.
static inline real3 bounced(real3 p, real3 n, global const real* light,
                            global const real* restrict texels, int samples, int2 part) {
  const int half_window = QJ_BOUNCE_LAST / 2;
  real3 across = real3_at(light + QJ_LIGHT_U), down = real3_at(light + QJ_LIGHT_V);
  real3 along = real3_at(light + QJ_LIGHT_DEPTH);
  real2 at = (real2)(dot(p, across) + light[QJ_LIGHT_U + 3], dot(p, down) + light[QJ_LIGHT_V + 3]);
  real depth = dot(p, along) + light[QJ_LIGHT_DEPTH + 3];
  across /= dot(across, across);
  down /= dot(down, down);
  real width = 2;  // of a level's texels, in those of the depth map
  real3 all = (real3)(0);
  int2 hole = (int2)(0);  // corner of the texels that finer levels have, and how many a side
  int hole_size = 0;
#pragma unroll 1
  for (int side = ((int)light[QJ_LIGHT_MAP_SIZE] + 1) / 2;; side = (side + 1) / 2) {
    bool is_last = side <= QJ_BOUNCE_LAST;
    int2 next = convert_int2(floor(at / (2 * width) + (real)0.5)) - half_window / 2;
    int2 low = max(2 * next, 0), high = min(2 * next + 2 * half_window, side);
    if (is_last) low = (int2)(0), high = (int2)(side);
    real texel = width * light[QJ_LIGHT_TEXEL];
    real3 sum = (real3)(0);
    for (int y = low.y + (part.y + samples - low.y % samples) % samples; y < high.y; y += samples) {
      for (int x = low.x + (part.x + samples - low.x % samples) % samples; x < high.x;
           x += samples) {
        uint2 in_hole = (uint2)((uint)(x - hole.x), (uint)(y - hole.y));
        global const real* t = texels + (y * side + x) * QJ_BOUNCE_SIZE;
        if (max(in_hole.x, in_hole.y) < (uint)hole_size || t[QJ_BOUNCE_DEPTH] < 0) continue;
        real2 away = ((real2)((real)x, (real)y) + (real)0.5) * width - at;
        real3 w = away.x * across + away.y * down + (t[QJ_BOUNCE_DEPTH] - depth) * along;
        real cosines =
            fmax(dot(n, w), (real)0) * fmax(-dot(real3_at(t + QJ_BOUNCE_NORMAL), w), (real)0);
        real d2 = dot(w, w) + square((real)0.25 * texel);
        sum += (cosines / (d2 * d2)) * real3_at(t + QJ_BOUNCE_ALBEDO);
      }
    }
    all += (texel * texel) * sum;
    if (is_last) break;
    texels += side * side * QJ_BOUNCE_SIZE;
    hole = next;
    hole_size = half_window;
    width *= 2;
  }
  return ((real)(samples * samples) * (real)0.318309886) * all;
}

// What lamps' light, sent on by the shape, gives to each receiver before the ground's.
kernel void bounce_light(qj_light_arguments with, real strength,
                         global const real* restrict receivers, global const real* restrict lights,
                         global const real* restrict texels, global real* restrict light) {
  int r = (int)get_global_id(0);
  if (r >= with.ground) return;
  real3 p = real3_at(receivers + (size_t)r * QJ_RECEIVER_SIZE + QJ_RECEIVER_POINT);
  real3 n = real3_at(receivers + (size_t)r * QJ_RECEIVER_SIZE + QJ_RECEIVER_NORMAL);
  int i = r % with.wide % with.samples, j = r / with.wide % with.samples;
  int lamps = dot(n, n) > 0 ? with.lamps : 0;
  real3 sum = (real3)(0);
  for (int lamp = 0; lamp < lamps; ++lamp) {
    global const real* from = lights + lamp * QJ_LIGHT_SIZE;
    sum += real3_at(from + QJ_LIGHT_COLOR) *
           bounced(p, n, from, texels + (int)from[QJ_LIGHT_BOUNCE], with.samples, (int2)(i, j));
  }
  put_real3(light + 3 * (size_t)r, strength * sum);
}

// The share of light from `from` that arrives at a point through the shape: it falls to 1/e in
// `thin`, and comes from texels as far around as that. The point lies on the surface, so that the
// way through is what the map sees before it.
static inline real seen_through(global const real* map, int size, real2 texel, real depth,
                                real thin, real texel_width, real2 direction) {
  const int taps = 16;
  real reach = fmin(thin / texel_width, (real)MOST_PENUMBRA), sum = 0;
#pragma unroll 1
  for (int i = 0; i < taps; ++i) {
    real2 p = floor(texel + reach * sqrt(((real)i + (real)0.5) / taps) * direction);
    direction = golden_turn(direction);
    sum += exp(-fmax(before(map, size, (int)p.x, (int)p.y, depth), (real)0) / thin);
  }
  return sum / taps;
}

// The shares of a lamp's light that reach each receiver, straight and through the shape. Samples of
// a pixel take their taps at different places. near_shadow: for each pixel of the strip, where
// `strip.has_near_shadow`, how far something too near to be in the maps keeps the first lamp's
// light off it, 0 … 255.
kernel void lamp_light(qj_light_arguments with, qj_strip_arguments strip,
                       global const uchar* restrict near_shadow,
                       global const real* restrict receivers, global const real* restrict lights,
                       global const real* restrict maps, global real* restrict light) {
  int r = (int)get_global_id(0);
  if (r >= with.receivers) return;
  real3 p = real3_at(receivers + (size_t)r * QJ_RECEIVER_SIZE + QJ_RECEIVER_POINT);
  real3 n = real3_at(receivers + (size_t)r * QJ_RECEIVER_SIZE + QJ_RECEIVER_NORMAL);
  global const real* from = lights + with.lamp * QJ_LIGHT_SIZE;
  global const real* map = maps + (int)from[QJ_LIGHT_MAP_FIRST];
  int size = (int)from[QJ_LIGHT_MAP_SIZE];
  bool is_ground = r >= with.ground;
  int i = r % with.wide % with.samples, j = r / with.wide % with.samples;
  real2 first = (real2)((real)1, is_ground ? 0 : (real)0.25 * (real)(j * with.samples + i));
  first *= rsqrt(dot(first, first));
  real seen = 0, through = 0;
  real3 l = real3_at(from + QJ_LIGHT_DIRECTION);
  if (dot(n, l) > 0) {
    light_sight s = sight_of(p, n, from);
    seen = seen_soft(map, size, s.texel, s.depth, from[QJ_LIGHT_SOFTNESS] / from[QJ_LIGHT_TEXEL],
                     is_ground ? (real)2.5 : with.narrowest, first);
    int pixel = r / with.wide / with.samples * strip.columns + r % with.wide / with.samples;
    if (strip.has_near_shadow && !is_ground && with.lamp == 0) {
      seen *= 1 - (real)near_shadow[pixel] / 255;
    }
  }
  if (with.thin > 0 && !is_ground && dot(n, n) > 0) {
    real2 texel = (real2)(dot(p, real3_at(from + QJ_LIGHT_U)) + from[QJ_LIGHT_U + 3],
                          dot(p, real3_at(from + QJ_LIGHT_V)) + from[QJ_LIGHT_V + 3]);
    real depth = dot(p, real3_at(from + QJ_LIGHT_DEPTH)) + from[QJ_LIGHT_DEPTH + 3];
    through = seen_through(map, size, texel, depth, with.thin, from[QJ_LIGHT_TEXEL], first);
  }
  light += ((size_t)with.lamp * with.receivers + r) * QJ_LAMP_SIZE;
  light[QJ_LAMP_SEEN] = seen;
  light[QJ_LAMP_THROUGH] = through;
}
