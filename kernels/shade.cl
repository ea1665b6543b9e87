// From depths to colours, in passes: normals, what receives light, the light it receives, colours.
// The sky is many lights, each with a depth map of the shape seen along it; the key light is one of
// them, with a penumbra. Work-items are scalar, whatever the lane width.

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

// The point of the ground that the ray of a pixel meets, where it is near enough to the shape for
// its shadow.
static inline bool ground_point(real3 origin, real3 direction, global const real* restrict scene,
                                real3* p, real* away) {
  real3 up = real3_at(scene + QJ_SCENE_UP);
  real height = dot(origin, up) - scene[QJ_SCENE_GROUND];
  real fall = -dot(direction, up);
  if (height <= 0 || fall <= (real)1e-3f) return false;
  *p = origin + (height / fall) * direction;
  *away = length(*p - real3_at(scene + QJ_SCENE_CENTER)) / scene[QJ_SCENE_RADIUS];
  return *away <= 6;
}

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

// What the sky, all but the key light, sends to the receivers before the ground's, and what it
// would send with nothing in the way.
kernel void sky_light(qj_light_arguments with, global const real* restrict receivers,
                      global const real* restrict lights, global const real* restrict maps,
                      global real* restrict light) {
  int r = (int)get_global_id(0);
  if (r >= with.ground) return;
  real3 p = real3_at(receivers + (size_t)r * QJ_RECEIVER_SIZE + QJ_RECEIVER_POINT);
  real3 n = real3_at(receivers + (size_t)r * QJ_RECEIVER_SIZE + QJ_RECEIVER_NORMAL);
  int count = dot(n, n) == 0 ? 0 : with.lights;
  real3 sky = (real3)(0), open_sky = (real3)(0);
  for (int i = 0; i < count; ++i) {
    global const real* from = lights + i * QJ_LIGHT_SIZE;
    if (i == with.key || dot(n, real3_at(from + QJ_LIGHT_DIRECTION)) <= 0) continue;
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

static inline real luminance(real3 c) { return dot(c, (real3)(0.2126f, 0.7152f, 0.0722f)); }

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

// The share of the key light that reaches each receiver. Samples of a pixel take their taps at
// different places. near_shadow: for each pixel of the strip, where `strip.has_near_shadow`, how
// far something too near to be in the maps keeps the light off it, 0 … 255.
kernel void key_light(qj_light_arguments with, qj_strip_arguments strip,
                      global const uchar* restrict near_shadow,
                      global const real* restrict receivers, global const real* restrict lights,
                      global const real* restrict maps, global real* restrict light) {
  int r = (int)get_global_id(0);
  if (r >= with.receivers) return;
  real3 p = real3_at(receivers + (size_t)r * QJ_RECEIVER_SIZE + QJ_RECEIVER_POINT);
  real3 n = real3_at(receivers + (size_t)r * QJ_RECEIVER_SIZE + QJ_RECEIVER_NORMAL);
  global const real* from = lights + with.key * QJ_LIGHT_SIZE;
  real seen = 0;
  if (dot(n, real3_at(from + QJ_LIGHT_DIRECTION)) > 0) {
    light_sight s = sight_of(p, n, from);
    int i = r % with.wide % with.samples, j = r / with.wide % with.samples;
    real2 first = (real2)((real)1, r < with.ground ? (real)0.25 * (real)(j * with.samples + i) : 0);
    first *= rsqrt(dot(first, first));
    seen = seen_soft(maps + (int)from[QJ_LIGHT_MAP_FIRST], (int)from[QJ_LIGHT_MAP_SIZE], s.texel,
                     s.depth, from[QJ_LIGHT_SOFTNESS] / from[QJ_LIGHT_TEXEL],
                     r < with.ground ? with.narrowest : (real)2.5, first);
    int pixel = r / with.wide / with.samples * strip.columns + r % with.wide / with.samples;
    if (strip.has_near_shadow && r < with.ground) {
      seen *= 1 - (real)near_shadow[pixel] / 255;
    }
  }
  light[(size_t)r * QJ_RECEIVED_SIZE + QJ_RECEIVED_KEY] = seen;
}

// What light a point receives.
typedef struct {
  real3 sky, open_sky;  // irradiance from all but the key light; the same with nothing in the way
  real3 key, open_key;
  real highlight;  // the key light's, 0 ... 1
} irradiance;

static inline irradiance received_by(real3 n, real3 view_direction,
                                     global const real* restrict key_light,
                                     global const real* restrict light) {
  irradiance e;
  e.sky = real3_at(light + QJ_RECEIVED_SKY);
  e.open_sky = real3_at(light + QJ_RECEIVED_OPEN_SKY);
  real3 l = real3_at(key_light + QJ_LIGHT_DIRECTION);
  real seen = light[QJ_RECEIVED_KEY];
  e.open_key = fmax(dot(n, l), (real)0) * real3_at(key_light + QJ_LIGHT_COLOR);
  e.key = seen * e.open_key;
  e.highlight = seen * powr(fmax(dot(n, normalize(l - view_direction)), (real)0), (real)28);
  return e;
}

// Ambient visibility with light bounced between surfaces of this albedo. Jimenez et al. 2016,
// "Practical real-time strategies for accurate indirect occlusion", Eq. 10.
static inline real3 with_bounces(real v, real3 albedo) {
  real3 a = (real)2.0404 * albedo - (real)0.3324;
  real3 b = (real)-4.7951 * albedo + (real)0.6417;
  real3 c = (real)2.7552 * albedo + (real)0.6903;
  return fmax((real3)(v), ((v * a + b) * v + c) * v);
}

// Colours of traits 0 … 1, through those of the scene.
static inline real3 trait_albedo(real t, global const real* restrict scene) {
  int last = (int)scene[QJ_SCENE_STOPS] - 1;
  real3 c = real3_at(scene + QJ_SCENE_STOP);
  t *= (real)last;
#pragma unroll 1
  for (int i = 0; i < last; ++i) {
    c = mix(c, real3_at(scene + QJ_SCENE_STOP + 3 * (i + 1)), clamp(t - (real)i, (real)0, (real)1));
  }
  return c;
}

// How much of the sky is seen, with what comes through gaps that depth maps are too coarse to see.
static inline real open_share(real seen) { return mix((real)0.06, (real)1, seen); }

static inline real3 lit(real3 albedo, irradiance e) {
  real v = open_share(luminance(e.sky) / fmax(luminance(e.open_sky), (real)1e-6f));
  real3 diffuse = albedo * (e.key + e.open_sky * with_bounces(v, albedo));
  return diffuse + (real)0.10 * e.highlight;
}

// Film-like: contrast in the middle, soft shoulder. Narkowicz 2015's fit of the ACES curve.
static inline real3 film(real3 c) {
  c = fmax((real)0.62 * c, (real3)(0));
  return clamp(
      (c * ((real)2.51 * c + (real)0.03)) / (c * ((real)2.43 * c + (real)0.59) + (real)0.14),
      (real3)(0), (real3)(1));
}

static inline real srgb_encode(real c) {
  return c <= (real)0.0031308 ? (real)12.92 * c
                              : (real)1.055 * powr(c, (real)(1 / 2.4)) - (real)0.055;
}

// Light backdrop, brightest behind the shape. `from_center`: pixel's place, 1 at the nearer edge.
static inline real3 backdrop(real2 from_center) {
  real r2 = dot(from_center, from_center);
  return mix((real3)(0.92f, 0.93f, 0.95f), (real3)(0.40f, 0.42f, 0.46f),
             (real)1 - (real)1 / (1 + (real)0.45 * r2));
}

// The sky's share that reaches a point of the ground, between the points where it is known.
static inline real ground_seen(real3 p, global const real* restrict scene,
                               global const real* restrict shares) {
  int side = (int)scene[QJ_SCENE_SIDE];
  real3 away = (p - real3_at(scene + QJ_SCENE_CENTER)) / scene[QJ_SCENE_RADIUS];
  real2 x = (real2)(dot(away, real3_at(scene + QJ_SCENE_RIGHT)),
                    dot(away, real3_at(scene + QJ_SCENE_FRONT)));
  real2 u = x / ((real2)(1) + (real)QJ_GROUND_CROWDING * fabs(x));
  real2 at = (real)0.5 * (u + (real2)(1)) * (real)(side - 1);
  at = clamp(at, (real2)(0), (real2)((real)(side - 1) - (real)1e-3f));
  real2 corner = floor(at), f = at - corner;
  global const real* s = shares + (int)corner.y * side + (int)corner.x;
  return mix(mix(s[0], s[1], f.x), mix(s[side], s[side + 1], f.x), f.y);
}

// How much darker shadows make the ground, of this color, where a ray that misses the shape meets
// it; 1 where there is none.
static inline real3 ground_share(real3 origin, real3 direction, global const real* restrict scene,
                                 global const real* restrict key_light,
                                 global const real* restrict shares,
                                 global const real* restrict light, real3 color) {
  real3 p;
  real away;
  if (!ground_point(origin, direction, scene, &p, &away)) return (real3)(1);
  real3 up = real3_at(scene + QJ_SCENE_UP), open_sky = real3_at(scene + QJ_SCENE_OPEN_SKY);
  real3 open_key = fmax(dot(up, real3_at(key_light + QJ_LIGHT_DIRECTION)), (real)0) *
                   real3_at(key_light + QJ_LIGHT_COLOR);
  // The ground is bright, and lights the shape's underside, which lights it in turn.
  real3 sky = open_sky * with_bounces(open_share(ground_seen(p, scene, shares)), color);
  real3 share = (sky + light[QJ_RECEIVED_KEY] * open_key) / (open_sky + open_key);
  return mix(share, (real3)(1), smoothstep((real)4, (real)6, away));
}

// sRGB bytes of the strip's pixels, each with how opaque it is. depth, normal: its samples and
// more; trait: as many, where there are any: below 0, how light clay is. ground: the sky's light on
// points of it. received: the light of the strip's receivers.
kernel void shade_pixels(qj_strip_arguments strip, global const real* restrict view,
                         global const real* restrict depth, global const real* restrict normal,
                         global const real* restrict trait, global const real* restrict key_light,
                         global const real* restrict scene, global const real* restrict ground,
                         global const real* restrict received, global uchar* restrict rgba) {
  int column = (int)get_global_id(0), row = (int)get_global_id(1);
  if (column >= strip.columns || row >= strip.rows) return;
  int samples = strip.samples;
  int wide = strip.columns * samples;
  real2 middle = (real2)((real)strip.columns, (real)strip.rows_in_all) / 2;
  real2 place = (real2)((real)column + (real)0.5, (real)(row + strip.first_row) + (real)0.5);
  real3 sum = (real3)(0);
  int misses = 0;
  for (int s = 0; s < samples * samples; ++s) {
    int i = column * samples + s % samples;
    int j = row * samples + s / samples;
    int index = (j + strip.halo) * wide + i;
    if (depth[index] < 0) {
      ++misses;
      continue;
    }
    real3 direction;
    view_point(view, (real)i + (real)0.5, (real)(j + strip.first_row * samples) + (real)0.5, 0,
               &direction);
    irradiance e = received_by(real3_at(normal + 3 * index), direction, key_light,
                               received + (size_t)(j * wide + i) * QJ_RECEIVED_SIZE);
    real3 albedo = real3_at(scene + QJ_SCENE_CLAY);
    if (strip.has_traits) {
      real t = trait[index];
      albedo = t < 0 ? -t * albedo : trait_albedo(t, scene);
    }
    sum += film(lit(albedo, e));
  }
  real opaque = 1;
  if (misses > 0) {
    int behind = (int)scene[QJ_SCENE_BACKDROP];
    real3 direction;
    real3 o = view_point(view, place.x * (real)samples, place.y * (real)samples, 0, &direction);
    int number = wide * strip.rows * samples + row * strip.columns + column;
    real3 color = backdrop((place - middle) / fmin(middle.x, middle.y));
    if (behind == QJ_BACKDROP_PLAIN) color = real3_at(scene + QJ_SCENE_COLOR);
    real3 share = ground_share(o, direction, scene, key_light, ground,
                               received + (size_t)number * QJ_RECEIVED_SIZE, color);
    if (behind == QJ_BACKDROP_NONE) {
      // Shadows are black, and as opaque as they are dark.
      opaque = 1 - (real)misses / (real)(samples * samples) * luminance(share);
    } else {
      sum += (real)misses * (behind == QJ_BACKDROP_PLAIN ? color * share : film(color * share));
    }
  }
  sum /= (real)(samples * samples) * fmax(opaque, (real)1e-6f);
  // Rounding by a fixed pattern hides steps in the backdrop.
  uint h = (uint)column * 1973u + (uint)(row + strip.first_row) * 9277u;
  h = (h ^ (h >> 13)) * 1274126177u;
  // Never so much that a whole number becomes another.
  real dither = (real)0.002 + (real)0.996 * (real)((h ^ (h >> 16)) & 0xffffu) / (real)65536;
  sum = fmin(sum, (real3)(1));
  size_t at = 4 * ((size_t)row * (size_t)strip.columns + (size_t)column);
  rgba[at] = (uchar)(srgb_encode(sum.x) * 255 + dither);
  rgba[at + 1] = (uchar)(srgb_encode(sum.y) * 255 + dither);
  rgba[at + 2] = (uchar)(srgb_encode(sum.z) * 255 + dither);
  rgba[at + 3] = (uchar)(opaque * 255 + dither);
}
