// What colours each pixel, filtered over a ball as wide as `width`: kernels/orbit_trait.cl.
#include map.glsl
#include view.glsl

uniform highp sampler2D depths;
uniform vec2 jitter;
uniform float width;
uniform vec3 upright, shape_translation;
uniform float shape_scale;  // map units
uniform int iterations;
uniform int kind;  // as in layout/picture_layout.h; 4: height
out vec4 result;

float resolved_of(float square) { return 1.0 - smoothstep(0.01, 0.08, square); }

float low, high;

float openness_of(float f) {
  return clamp(min((f - low) / (map_surface_level - low), (high - f) / (high - map_surface_level)), 0.0, 1.0);
}

// Means over the corners' images by an iterate.
float angle, openness, rise, turned, risen;

void iterate(inout vec4 corners[4]) {
  vec4 direction = vec4(0.0);
  float squares = 0.0;
  angle = openness = rise = 0.0;
  for (int i = 0; i < 4; ++i) {
    float f = map_modulus(corners[i]);
    corners[i] = map_image(corners[i], f);
    vec4 unit = corners[i] - map_origin();
    unit *= lane_rsqrt(max(dot(unit, unit), QJ_TINY));
    direction += 0.25 * unit;
    angle += 0.25 * abs(unit.x);
    openness += 0.25 * openness_of(f);
    f = clamp(f, low - 1.0, high + 1.0) - map_surface_level;
    rise += 0.25 * f;
    squares += 0.25 * f * f;
  }
  float narrow = min(map_surface_level - low, high - map_surface_level);
  turned = 1.0 - dot(direction, direction);
  risen = max(squares - rise * rise, 0.0) / (narrow * narrow);
}

float orbit_trait(vec4 corners[4]) {
  low = clamp(map_log_inner, map_surface_level - 2.0, map_surface_level - 1e-3);
  high = clamp(min(map_log_escape, map_log_outer), map_surface_level + 1e-3, map_surface_level + 2.0);
  int last = kind == 0 ? iterations : min(iterations, kind == 1 ? 2 : 1);
  float count = 0.0, open = 1.0, resolved = 1.0, groove = 0.0;
  vec2 closeness = vec2(0.0), told = vec2(0.0);
  int m = 0;
  for (; m < last && resolved * open > 1e-4; ++m) {
    iterate(corners);
    if (kind == 0) open *= mix(0.7, openness, resolved * resolved_of(risen));
    count += open;
    if (m == 0) {
      float middle = (map_surface_level - low) / (high - low), narrow = min(middle, 1.0 - middle);
      groove = mix(middle, clamp((map_surface_level + rise - low) / (high - low), 0.0, 1.0), resolved_of(narrow * narrow * risen));
    }
    resolved *= resolved_of(turned);
    if (m < 2) closeness[m] = angle, told[m] = resolved;
  }
  if (kind == 2) return groove;
  if (kind == 0) return (count + open * 0.7 / 0.3 * (1.0 - pow(0.7, float(iterations - m)))) / float(iterations);
  float a = closeness.x;
  if (iterations == 1) return mix(0.4244, a, told.x);
  float lesser = a * (1.0 + a * (-0.6366 + a * (-0.0292 + a * 0.0902)));
  return mix(0.2724, mix(lesser, min(a, closeness.y), told.y), told.x);
}

#ifdef CENTER
float factor_trait(vec4 q) {
  float nearest = 1e30, sum = 0.0, weights = 0.0;
  for (int g = 0; g < groups; ++g) {
    for (int j = 0; j < 4; ++j) {
      vec4 d = q - CENTER(4 * g + j);
      if (EXPONENTS(g)[j] != 0.0) nearest = min(nearest, max(dot(d, d), 1e-12));
    }
  }
  float sharpness = sqrt(nearest) / max(width, 1e-9);
  for (int g = 0; g < groups; ++g) {
    for (int j = 0; j < 4; ++j) {
      float a = EXPONENTS(g)[j];
      if (a == 0.0) continue;
      vec4 d = q - CENTER(4 * g + j);
      float weight = exp2(max(sharpness * log2(nearest / max(dot(d, d), 1e-12)), -60.0));
      sum += weight * 0.5 * (fract(float(4 * g + j + 1) * 0.618034) + (a > 0.0 ? 1.0 : 0.0));
      weights += weight;
    }
  }
  return sum / max(weights, QJ_TINY);
}
#else
float factor_trait(vec4 q) { return 0.0; }
#endif

void main() {
  float t = texelFetch(depths, ivec2(gl_FragCoord.xy), 0).x;
  if (t < 0.0) {
    result = vec4(-1e30);
    return;
  }
  vec3 p = eye + t * view_direction(gl_FragCoord.xy + jitter);
  if (kind == 4) {
    result = vec4(dot(upright, p - shape_translation) / shape_scale);
  } else if (kind == 3) {
    result = vec4(factor_trait(vec4(p, map_slice)));
  } else {
    float away = 0.5 * width / sqrt(3.0);
    vec4 corners[4];
    corners[0] = vec4(p + away, map_slice);
    corners[1] = vec4(p + away * vec3(1, -1, -1), map_slice);
    corners[2] = vec4(p + away * vec3(-1, 1, -1), map_slice);
    corners[3] = vec4(p + away * vec3(-1, -1, 1), map_slice);
    result = vec4(orbit_trait(corners));
  }
}
