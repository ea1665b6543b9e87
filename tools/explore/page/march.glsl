// First hits of a tile's rays, a few turns a draw: kernels/ray_march.cl. What a ray has found so far
// is kept in a texture from draw to draw: x the depth reached, map units (in the end that of the hit,
// or -1), y the last depth outside, z the mode, w iterates + 4096 versors.
#include map.glsl
#include view.glsl

#define MARCHING 0.0
#define HINTED 1.0     // marching from a hint that may lie inside
#define BISECTING 2.0
#define DECIDED 3.0    // and on: + the draw that decided it

uniform sampler2D before;  // draws read one texture and write another, by turns
uniform int draw;          // 0 begins
uniform vec2 jitter;
uniform vec3 box_low, box_high;  // of the shape, map coordinates
uniform vec3 cut;                // where the set is cut open, shares of the box; 1: it is not
uniform highp sampler3D grid;  // of grid.glsl
uniform vec3 grid_low, grid_high, grid_cells;
uniform highp sampler2D hints;        // a coarser picture's result
uniform float hint_step;              // width of its pixels, map units; 0: no hints
uniform float hint_divisor;           // its pixels are so many of these
uniform float band_slope;  // of the file's F_1 where the band of undecided points ends
uniform float footprint;   // a pixel's width, map units
uniform int iterations, turns;
out vec4 result;

// An orbit whose F_1 is above the first is decided; F_1 rises by the second a map unit at most.
float far_level, steepest;

float grid_safe_step(vec3 p) {
  vec3 at = (p - grid_low) / (grid_high - grid_low);
  vec2 g = textureLod(grid, (at * grid_cells + 0.5) / (grid_cells + 1.0), 0.0).xy;
  float plain = min((map_steep(map_raised(g.x)) - far_level) / steepest, g.y);
  return map_safe_step(vec4(p, map_slice), iterations, far_level, steepest, plain);
}

// Where a ray is in a box: from x to y.
vec2 chord(vec3 origin, vec3 direction, vec3 low, vec3 high) {
  vec3 speed = mix(direction, vec3(1e-9), lessThan(abs(direction), vec3(1e-9)));
  vec3 a = (low - origin) / speed, b = (high - origin) / speed, enter = min(a, b), leave = max(a, b);
  return vec2(max(enter.x, max(enter.y, enter.z)), min(leave.x, min(leave.y, leave.z)));
}

// A depth before the hit, where the coarser picture is smooth all around; 0 where it is not.
float hint() {
  if (hint_step == 0.0) return 0.0;
  ivec2 size = textureSize(hints, 0), at = ivec2(gl_FragCoord.xy / hint_divisor);
  float nearest = 1e9, farthest = -1e9;
  for (int y = -1; y <= 1; ++y) {
    for (int x = -1; x <= 1; ++x) {
      float t = texelFetch(hints, clamp(at + ivec2(x, y), ivec2(0), size - 1), 0).x;
      if (t < 0.0) return 0.0;
      nearest = min(nearest, t), farthest = max(farthest, t);
    }
  }
  return farthest - nearest < 12.0 * hint_step ? nearest - hint_step : 0.0;
}

void main() {
  vec3 ray = view_direction(gl_FragCoord.xy + jitter);
  float log_radius = min(map_log_escape, map_log_outer), radius = exp(log_radius);
  far_level = iterations == 1 ? map_surface_level : log_radius;
  steepest = max(MAP_SHARPNESS * map_steepness * band_slope, 1e-3);
  // The shell is 1 / steepest thick.
  float thin = PORTALS > 0 ? 0.0 : 1.0 / (40.0 * steepest);
  float shortest = min(max(footprint, thin), 1.0 / (6.0 * steepest));
  float tolerance = footprint / 4.0;
  vec3 foot = eye - map_origin().xyz;
  float middle = -dot(foot, ray), half2 = middle * middle + radius * radius - dot(foot, foot);
  float half_chord = sqrt(max(half2, 0.0));
  // Nothing is cut away at 1.
  vec3 seen_high = mix(mix(box_low, box_high, cut), vec3(1e6), greaterThanEqual(cut, vec3(1)));
  vec2 seen = chord(eye, ray, vec3(-1e6), seen_high);
  vec2 known = chord(eye, ray, grid_low, grid_high);
  float start = max(max(seen.x, known.x), max(middle - half_chord, 0.0));
  float end = half2 < 0.0 ? 0.0 : min(min(seen.y, known.y), middle + half_chord);
  vec3 cell = (grid_high - grid_low) / grid_cells;
  float grid_step = max(cell.x, max(cell.y, cell.z)), near = 0.25 * grid_step;

  float t, outside = start, mode = MARCHING, count = 0.0;
  if (draw > 0) {
    vec4 state = texelFetch(before, ivec2(gl_FragCoord.xy), 0);
    if (state.z >= DECIDED) {
      if (state.z < DECIDED + float(draw - 1)) discard;  // it is in both textures
      result = state;
      return;
    }
    t = state.x, outside = state.y, mode = state.z, count = state.w;
  } else {
    t = max(start, hint());
    if (t > start) mode = HINTED;
  }
  float probe;
  int done = 0;  // iterates of the orbit
  float share = 1.0;  // the product of those of its points
  vec4 q;
  for (int turn = 0; turn < turns || done > 0; ++turn) {
    if (done == 0) {
      if (mode != BISECTING) {
        float from = t;
        while (t < end) {
          float safe = grid_safe_step(eye + t * ray);
          if (safe < near) break;
          t += safe;
        }
        if (t >= end) {
          t = -1.0, mode = DECIDED + float(draw);
          break;
        }
        if (t > from) outside = max(t - near, start);
      }
      probe = mode == BISECTING ? 0.5 * (outside + t) : t;
      q = vec4(eye + probe * ray, map_slice);
      share = 1.0;
    }
    float f = map_modulus(q);
    share *= paint_share(q);
    ++done, count += 1.0;
    if (done < iterations && f < log_radius && f > map_log_inner) {  // undecided: to the image
      q = map_image(q, f), count += 4096.0;
      continue;
    }
    if (f < map_surface_level) {
      if (mode == HINTED) mode = MARCHING, t = start;  // the hint was inside: start again without it
      else mode = BISECTING, t = probe;
    } else {
      outside = probe;
      // Each iterate stretches by about the slope, where detail is painted by more.
      float away = (f - far_level) * share * pow(steepest, -float(done));
      if (mode != BISECTING) mode = MARCHING, t += clamp(away, shortest, grid_step);
    }
    done = 0;
    if (mode == BISECTING && t - outside <= tolerance) {
      t = 0.5 * (outside + t), mode = DECIDED + float(draw);
      break;
    }
  }
  result = vec4(t, outside, mode, count);
}
