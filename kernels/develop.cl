// From the light that samples receive to the pixels of a picture: radiance first, then colours.

#include "ground.clh"
#include "matter.clh"
#include "tone.clh"
#include "view.clh"

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

static inline real srgb_encode(real c) {
  return c <= (real)0.0031308 ? (real)12.92 * c
                              : (real)1.055 * powr(c, (real)(1 / 2.4)) - (real)0.055;
}

// A light wall, brightest behind the shape. `from_center`: pixel's place, 1 at the nearer edge.
static inline real3 wall(real2 from_center) {
  real r2 = dot(from_center, from_center);
  return mix((real3)(1.04f, 1.05f, 1.07f), (real3)(0.50f, 0.52f, 0.56f),
             (real)1 - (real)1 / (1 + (real)0.45 * r2));
}

// How much darker shadows make the ground, of this color, where a ray that misses the shape meets
// it; 1 where there is none. seen: what of the lamps arrives at receiver `number`.
static inline real3 ground_share(qj_strip_arguments strip, real3 origin, real3 direction,
                                 global const real* restrict scene,
                                 global const real* restrict lamps,
                                 global const real* restrict shares,
                                 global const real* restrict seen, size_t receivers, size_t number,
                                 real3 color) {
  real3 p;
  real away;
  if (!ground_point(origin, direction, scene, &p, &away)) return (real3)(1);
  real3 up = real3_at(scene + QJ_SCENE_UP), open = real3_at(scene + QJ_SCENE_OPEN_SKY);
  // The ground is bright, and lights the shape's underside, which lights it in turn.
  real3 sum = open * with_bounces(open_share((real3)(ground_seen(p, scene, shares))), color);
  for (int i = 0; i < strip.lamps; ++i) {
    global const real* lamp = lamps + i * QJ_LIGHT_SIZE;
    real3 light = fmax(dot(up, real3_at(lamp + QJ_LIGHT_DIRECTION)), (real)0) *
                  real3_at(lamp + QJ_LIGHT_COLOR);
    open += light;
    sum += seen[(i * receivers + number) * QJ_LAMP_SIZE + QJ_LAMP_SEEN] * light;
  }
  real all = luminance(open), lit = all > (real)1e-6f ? fmin(luminance(sum) / all, (real)1) : 1;
  // Shadows have the colour of the light that is left, but where a part of the spectrum is missing
  // from all light they are grey.
  bool is_whole = fmin(fmin(open.x, open.y), open.z) > (real)0.05 * all && all > (real)1e-6f;
  real3 share = is_whole ? clamp(sum / open, (real3)(0), (real3)(1)) : (real3)(lit);
  return mix(share, (real3)(1), smoothstep((real)4, (real)6, away));
}

// The share of the glow at a place of the palette.
static inline real glowing(global const real* restrict scene, real place) {
  real way = scene[QJ_SCENE_GLOW_FULL] - scene[QJ_SCENE_GLOW_FROM];
  real share = (place - scene[QJ_SCENE_GLOW_FROM]) / (fabs(way) < (real)1e-3f ? (real)1e-3f : way);
  return place < 0 ? (real)0 : smoothstep((real)0, (real)1, share);
}

static inline void add_part(global real* at, real3 v) {
  at[0] += v.x;
  at[1] += v.y;
  at[2] += v.z;
}

// Work-items of these kernels: (column, row), a pixel of the strip.

// What each pixel shows, before it is developed. depth, normal: samples of the strip and more;
// trait: as many, where there are any: below 0, how light clay is. lamps: those of the lights.
// ground: the sky's light on points of it. sky, seen: what the strip's receivers get of the sky and
// of the lamps. parts: what radiance is made of, where the strip has parts.
kernel void pixel_radiance(qj_strip_arguments strip, global const real* restrict view,
                           global const real* restrict depth, global const real* restrict normal,
                           global const real* restrict trait, global const real* restrict lamps,
                           global const real* restrict scene, global const real* restrict table,
                           global const real* restrict around, global const real* restrict ground,
                           global const real* restrict sky, global const real* restrict seen,
                           global const real* restrict bounce, global real* restrict pixels,
                           global real* restrict parts) {
  int column = (int)get_global_id(0), row = (int)get_global_id(1);
  if (column >= strip.columns || row >= strip.rows) return;
  int samples = strip.samples, wide = strip.columns * samples;
  size_t of_samples = (size_t)wide * (size_t)(strip.rows * samples);
  size_t receivers = of_samples + (size_t)strip.columns * (size_t)strip.rows;
  real3 sum = (real3)(0);
  real shown = 0;
  int misses = 0, part_size = QJ_PART_LAMPS + 3 * strip.lamps;
  global real* part =
      parts + (size_t)(strip.has_parts ? row * strip.columns + column : 0) * part_size;
  for (int i = 0; strip.has_parts && i < part_size; ++i) part[i] = 0;
  for (int s = 0; s < samples * samples; ++s) {
    int i = column * samples + s % samples;
    int j = row * samples + s / samples;
    int index = (j + strip.halo) * wide + i;
    real t = depth[index];
    if (t < 0) {
      ++misses;
      continue;
    }
    real3 direction;
    real3 eye = view_point(view, (real)i + (real)0.5,
                           (real)(j + strip.first_row * samples) + (real)0.5, 0, &direction);
    real3 n = real3_at(normal + 3 * index);
    real3 albedo = real3_at(scene + QJ_SCENE_CLAY), glow = (real3)(0);
    if (strip.has_traits) {
      real place = trait[index];
      albedo = place < 0 ? -place * albedo : trait_albedo(place, scene);
      glow = scene[QJ_SCENE_GLOW] * glowing(scene, place) * albedo;
    }
    matter m = matter_of(scene, albedo);
    size_t receiver = (size_t)(j * wide + i);
    real3 open_sky = real3_at(sky + receiver * QJ_RECEIVED_SIZE + QJ_RECEIVED_OPEN_SKY);
    real3 seen_sky = real3_at(sky + receiver * QJ_RECEIVED_SIZE + QJ_RECEIVED_SKY);
    real3 open = open_share(seen_sky / fmax(open_sky, (real3)(1e-6f)));
    if (scene[QJ_SCENE_AROUND_WIDTH] > 0) {
      // Lights of the sky are few, and say what is in the way alone.
      open_sky = around_at(blurred_around(scene, around, QJ_ENVIRONMENT_LEVELS),
                           QJ_ENVIRONMENT_WIDTH, QJ_ENVIRONMENT_HEIGHT, around_place(scene, n));
    }
    real3 to_center = real3_at(scene + QJ_SCENE_CENTER) - eye;
    real3 turn = real3_at(view + QJ_VIEW_DIR_DX);
    // From a plane where rays are parallel, else from the eye.
    real middle = dot(turn, turn) > 0 ? length(to_center) : dot(to_center, direction);
    real behind = (t - middle) / scene[QJ_SCENE_RADIUS] + 1;
    real left = exp(scene[QJ_SCENE_FOG] * fmax(behind, (real)0));
    real weight = left / (real)(samples * samples);
    real3 of_sky = sent_of_sky(m, n, -direction, open, open_sky, scene, around, table);
    real3 sent = glow + of_sky;
    if (strip.has_parts) {
      add_part(part + QJ_PART_ALBEDO, weight * albedo);
      add_part(part + QJ_PART_SKY, weight * of_sky);
      add_part(part + QJ_PART_GLOW, weight * glow);
    }
    for (int lamp = 0; lamp < strip.lamps; ++lamp) {
      global const real* light = lamps + lamp * QJ_LIGHT_SIZE;
      global const real* arrived = seen + (lamp * receivers + receiver) * QJ_LAMP_SIZE;
      real3 of_lamp = sent_of_lamp(m, n, -direction, real3_at(light + QJ_LIGHT_DIRECTION),
                                   real3_at(light + QJ_LIGHT_COLOR), light[QJ_LIGHT_SOFTNESS],
                                   arrived[QJ_LAMP_SEEN], arrived[QJ_LAMP_THROUGH], table);
      sent += of_lamp;
      if (strip.has_parts) add_part(part + QJ_PART_LAMPS + 3 * lamp, weight * of_lamp);
    }
    if (scene[QJ_SCENE_BOUNCE] > 0) {
      real3 of_bounce = sent_of_bounce(m, n, -direction, real3_at(bounce + 3 * receiver), table);
      sent += of_bounce;
      if (strip.has_parts) add_part(part + QJ_PART_BOUNCE, weight * of_bounce);
    }
    sum += left * sent;
    shown += left;
  }
  real3 share = (real3)(1);
  if (misses > 0) {
    real3 direction;
    real2 place = (real2)((real)column + (real)0.5, (real)(row + strip.first_row) + (real)0.5);
    real3 o = view_point(view, place.x * (real)samples, place.y * (real)samples, 0, &direction);
    real3 color = scene[QJ_SCENE_BACKDROP] == QJ_BACKDROP_PLAIN ? real3_at(scene + QJ_SCENE_COLOR)
                                                                : (real3)(0.8f);
    share = ground_share(strip, o, direction, scene, lamps, ground, seen, receivers,
                         of_samples + (size_t)(row * strip.columns + column), color);
  }
  global real* pixel =
      pixels + ((size_t)row * (size_t)strip.columns + (size_t)column) * QJ_PIXEL_SIZE;
  real each = 1 / (real)(samples * samples);
  sum *= each;
  // Behind fog is what is farther away than any shadow.
  share = ((real)misses * share + ((real)(samples * samples - misses) - shown)) * each;
  if (scene[QJ_SCENE_BACKDROP] == QJ_BACKDROP_AROUND) {
    real3 direction;
    view_point(view, ((real)column + (real)0.5) * (real)samples,
               ((real)(row + strip.first_row) + (real)0.5) * (real)samples, 0, &direction);
    share *= around_at(around, (int)scene[QJ_SCENE_AROUND_WIDTH],
                       (int)scene[QJ_SCENE_AROUND_HEIGHT], around_place(scene, direction));
  }
  pixel[QJ_PIXEL_RADIANCE] = sum.x;
  pixel[QJ_PIXEL_RADIANCE + 1] = sum.y;
  pixel[QJ_PIXEL_RADIANCE + 2] = sum.z;
  pixel[QJ_PIXEL_SHOWN] = shown * each;
  pixel[QJ_PIXEL_GROUND] = share.x;
  pixel[QJ_PIXEL_GROUND + 1] = share.y;
  pixel[QJ_PIXEL_GROUND + 2] = share.z;
}

// Radiance of what is behind the shape where that is lit, as it is seen through a pixel.
static inline real3 lit_behind(qj_strip_arguments strip, int column, int row,
                               global const real* restrict scene, global const real* pixel) {
  real3 light = real3_at(pixel + QJ_PIXEL_GROUND);
  if (scene[QJ_SCENE_BACKDROP] != QJ_BACKDROP_STUDIO) return light;
  real2 middle = (real2)((real)strip.columns, (real)strip.rows_in_all) / 2;
  real2 place = (real2)((real)column + (real)0.5, (real)(row + strip.first_row) + (real)0.5);
  return light * wall((place - middle) / fmin(middle.x, middle.y)) *
         real3_at(scene + QJ_SCENE_WALL_LIGHT);
}

// What is behind the shape in each pixel, linear and before the tone curve, and how opaque the
// pixel is.
kernel void behind_pixels(qj_strip_arguments strip, real exposure,
                          global const real* restrict scene, global const real* restrict pixels,
                          global real* restrict rgba) {
  int column = (int)get_global_id(0), row = (int)get_global_id(1);
  if (column >= strip.columns || row >= strip.rows) return;
  size_t number = (size_t)row * (size_t)strip.columns + (size_t)column;
  global const real* pixel = pixels + number * QJ_PIXEL_SIZE;
  int behind = (int)scene[QJ_SCENE_BACKDROP];
  real3 light = exposure * lit_behind(strip, column, row, scene, pixel);
  real3 shadow = real3_at(pixel + QJ_PIXEL_GROUND);
  if (behind == QJ_BACKDROP_PLAIN) light = shadow * real3_at(scene + QJ_SCENE_COLOR);
  if (behind == QJ_BACKDROP_NONE) light = (real3)(0);
  rgba[4 * number] = light.x;
  rgba[4 * number + 1] = light.y;
  rgba[4 * number + 2] = light.z;
  rgba[4 * number + 3] = behind == QJ_BACKDROP_NONE ? 1 - luminance(shadow) : (real)1;
}

// sRGB numbers of the strip's pixels, each with how opaque it is. The shape and what is behind it
// are developed apart, so that a plain background has exactly its color. exposure: what radiance is
// multiplied by. most: the number that stands for 1.
kernel void develop_pixels(qj_strip_arguments strip, real exposure, real most,
                           global const real* restrict scene, global const real* restrict pixels,
                           global ushort* restrict rgba) {
  int column = (int)get_global_id(0), row = (int)get_global_id(1);
  if (column >= strip.columns || row >= strip.rows) return;
  size_t number = (size_t)row * (size_t)strip.columns + (size_t)column;
  global const real* pixel = pixels + number * QJ_PIXEL_SIZE;
  int tone = (int)scene[QJ_SCENE_TONE], behind = (int)scene[QJ_SCENE_BACKDROP];
  real shown = pixel[QJ_PIXEL_SHOWN];
  real3 behind_light = real3_at(pixel + QJ_PIXEL_GROUND), sum = (real3)(0);
  // The shape first, then the wall. One loop, so that no GPU calls the curve as a function.
#pragma unroll 1
  for (int part = 0; part < 2; ++part) {
    bool is_lit = behind == QJ_BACKDROP_STUDIO || behind == QJ_BACKDROP_AROUND;
    real weight = part == 0 ? shown : is_lit ? 1 - shown : (real)0;
    if (weight <= 0) continue;
    real3 radiance = real3_at(pixel + QJ_PIXEL_RADIANCE);
    if (part == 1) radiance = lit_behind(strip, column, row, scene, pixel);
    sum += weight * tone_mapped(tone, exposure * radiance / weight);
  }
  real opaque = 1;
  if (behind == QJ_BACKDROP_NONE) {
    // Shadows are black, and as opaque as they are dark.
    opaque = 1 - luminance(behind_light);
  } else if (behind == QJ_BACKDROP_PLAIN) {
    sum += behind_light * real3_at(scene + QJ_SCENE_COLOR);
  }
  sum /= fmax(opaque, (real)1e-6f);
  // Rounding by a fixed pattern hides steps in the backdrop.
  uint h = (uint)column * 1973u + (uint)(row + strip.first_row) * 9277u;
  h = (h ^ (h >> 13)) * 1274126177u;
  // Never so much that a whole number becomes another.
  real dither = (real)0.002 + (real)0.996 * (real)((h ^ (h >> 16)) & 0xffffu) / (real)65536;
  sum = clamp(sum, (real3)(0), (real3)(1));
  rgba[4 * number] = (ushort)(srgb_encode(sum.x) * most + dither);
  rgba[4 * number + 1] = (ushort)(srgb_encode(sum.y) * most + dither);
  rgba[4 * number + 2] = (ushort)(srgb_encode(sum.z) * most + dither);
  rgba[4 * number + 3] = (ushort)(opaque * most + dither);
}

// The luminance of the light that arrives at each sample; below 0 where there is none: what an
// exposure meter at the shape reads.
kernel void incident_light(qj_light_arguments with, global const real* restrict receivers,
                           global const real* restrict lamps, global const real* restrict sky,
                           global const real* restrict seen, global real* restrict light) {
  int r = (int)get_global_id(0);
  if (r >= with.ground) return;
  real3 n = real3_at(receivers + (size_t)r * QJ_RECEIVER_SIZE + QJ_RECEIVER_NORMAL);
  real sum = luminance(real3_at(sky + (size_t)r * QJ_RECEIVED_SIZE + QJ_RECEIVED_SKY));
  for (int i = 0; i < with.lamps; ++i) {
    global const real* lamp = lamps + i * QJ_LIGHT_SIZE;
    sum += seen[((size_t)i * with.receivers + r) * QJ_LAMP_SIZE + QJ_LAMP_SEEN] *
           fmax(dot(n, real3_at(lamp + QJ_LIGHT_DIRECTION)), (real)0) *
           luminance(real3_at(lamp + QJ_LIGHT_COLOR));
  }
  light[r] = dot(n, n) > 0 ? sum : (real)-1;
}
