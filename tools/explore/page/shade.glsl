// From depths to colours, linear: kernels/shade.cl and develop.cl. Depth maps of lights are
// replaced by what the picture itself shows of neighbours.
#include view.glsl

uniform vec3 palette_clay, palette_stops[8];
uniform int palette_last;
uniform highp sampler2D depths, traits;
uniform vec2 jitter;
uniform vec2 canvas;    // pixels that are drawn
uniform float divisor;  // one of depths is so many of these a side
uniform vec3 right, up, back, upright, key_direction, rim_direction;
uniform float footprint, key_strength;
uniform bool has_traits, is_dark;
uniform float trait_range[9];
out vec4 color;

ivec2 bounds;
float depth_at(ivec2 at) {
  if (any(lessThan(at, ivec2(0))) || any(greaterThan(at, bounds))) return -1.0;
  return texelFetch(depths, at, 0).x;
}
vec3 point_at(vec2 at, float t) { return eye + t * view_direction(at + 0.5 + jitter); }

// Kernel normals_of_depth: a plane of depths fitted to the 5 x 5 pixels around.
vec3 normal_at(ivec2 at, float t) {
  float w = 0.0, wx = 0.0, wy = 0.0, wd = 0.0, wxx = 0.0, wxy = 0.0, wyy = 0.0, wxd = 0.0, wyd = 0.0;
  for (int j = -2; j <= 2; ++j) {
    for (int i = -2; i <= 2; ++i) {
      float d = depth_at(at + ivec2(i, j));
      if (d < 0.0) continue;
      d -= t;
      float x = float(i), y = float(j), r = d / (2.0 * footprint);
      float c = 1.0 / ((1.0 + r * r) * (1.0 + 0.25 * (x * x + y * y)));
      w += c, wx += c * x, wy += c * y, wd += c * d;
      wxx += c * x * x, wxy += c * x * y, wyy += c * y * y, wxd += c * x * d, wyd += c * y * d;
    }
  }
  wxx -= wx * wx / w, wxy -= wx * wy / w, wyy -= wy * wy / w, wxd -= wx * wd / w, wyd -= wy * wd / w;
  vec2 p = vec2(at);
  vec3 direction = view_direction(p + 0.5 + jitter), n = -direction;
  float det = wxx * wyy - wxy * wxy;
  if (det > 1e-3 * w * w) {
    float gx = (wxd * wyy - wyd * wxy) / det, gy = (wyd * wxx - wxd * wxy) / det;
    n = normalize(cross(point_at(p + vec2(1, 0), t + gx) - point_at(p - vec2(1, 0), t - gx),
                        point_at(p + vec2(0, 1), t + gy) - point_at(p - vec2(0, 1), t - gy)));
    if (dot(n, direction) > 0.0) n = -n;
  }
  return n;
}

// The share of the sky that neighbours in the picture leave open: rings of taps, their horizons.
float open_share(ivec2 at, vec3 p, vec3 n, float reach, float turn) {
  float hidden = 0.0;
  for (int i = 0; i < 24; ++i) {
    float angle = turn + float(i) * 2.39996, far = reach * (float(i) + 0.7) / 24.0;
    ivec2 there = at + ivec2(round(far * vec2(cos(angle), sin(angle))));
    float t = depth_at(there);
    if (t < 0.0) continue;
    vec3 d = point_at(vec2(there), t) - p;
    float rise = dot(n, d) * inversesqrt(dot(d, d) + 1e-12);
    hidden += max(rise - 0.08, 0.0) / (1.0 + 8.0 * dot(d, d));
  }
  return mix(0.06, 1.0, clamp(1.0 - hidden / 4.5, 0.0, 1.0));
}

// Whether the key light reaches p, as far as the picture shows what is in its way.
float key_light(vec3 p, vec3 n, float turn) {
  float lit = 1.0, reach = 0.9;
  vec3 from = p + 2.0 * footprint * n;
  for (int i = 0; i < 28; ++i) {
    float along = (float(i) + turn) / 28.0;
    vec3 q = from + key_direction * (reach * along * along + 2.0 * footprint) - eye;
    float ahead = -dot(q, back);
    // dir_dx is as long as a pixel is wide at distance 1.
    vec2 at = vec2(dot(q, right) / length(dir_dx), dot(q, up) / length(dir_dy)) / ahead +
              0.5 * canvas / divisor - jitter;
    float t = depth_at(ivec2(floor(at)));
    float behind = length(q) - t;
    if (t > 0.0 && behind > 1.5 * footprint && behind < 0.6) lit = min(lit, along);
  }
  return lit == 1.0 ? 1.0 : 0.35 * lit * lit;
}

// Colours of traits, from one end of their range to the other through those of the palette.
vec3 trait_albedo(float trait) {
  float t = 0.0;
  for (int i = 0; i < 8; ++i) {
    t += 0.125 * clamp((trait - trait_range[i]) / (trait_range[i + 1] - trait_range[i]), 0.0, 1.0);
  }
  vec3 c = palette_stops[0];
  t *= float(palette_last);
  for (int i = 0; i < palette_last; ++i) c = mix(c, palette_stops[i + 1], clamp(t - float(i), 0.0, 1.0));
  return c;
}

vec3 with_bounces(float v, vec3 albedo) {
  vec3 a = 2.0404 * albedo - 0.3324, b = -4.7951 * albedo + 0.6417, c = 2.7552 * albedo + 0.6903;
  return max(vec3(v), ((v * a + b) * v + c) * v);
}

// tone_neutral of kernels/tone.clh, at an exposure of 0.
vec3 developed(vec3 c) {
  c = 0.62 * max(c, 0.0);
  float least = min(min(c.x, c.y), c.z);
  c -= least < 0.08 ? least - 6.25 * least * least : 0.04;
  float peak = max(max(c.x, c.y), c.z);
  if (peak < 0.76) return c;
  float new_peak = 1.0 - 0.0576 / (peak - 0.52);
  return mix(c * (new_peak / peak), vec3(new_peak), 1.0 - 1.0 / (0.15 * (peak - new_peak) + 1.0));
}

// ggx of kernels/matter.clh, of the usual roughness.
float highlight(vec3 n, vec3 v, vec3 l) {
  const float a2 = 0.108;
  float nl = dot(n, l), nv = max(dot(n, v), 1e-3);
  if (nl <= 0.0) return 0.0;
  vec3 h = normalize(l + v);
  float nh = dot(n, h), d = nh * nh * (a2 - 1.0) + 1.0;
  float shadowing = nl * sqrt(nv * nv * (1.0 - a2) + a2) + nv * sqrt(nl * nl * (1.0 - a2) + a2);
  float fresnel = 0.04 + 0.96 * pow(max(1.0 - dot(v, h), 0.0), 5.0);
  return fresnel * 0.5 * a2 / (d * d) / shadowing * nl;
}

vec3 backdrop(vec2 from_center) {
  float far = 1.0 - 1.0 / (1.0 + 0.45 * dot(from_center, from_center));
  if (is_dark) return mix(vec3(0.10, 0.105, 0.12), vec3(0.02, 0.02, 0.025), far);
  return mix(vec3(1.04, 1.05, 1.07), vec3(0.50, 0.52, 0.56), far);
}

void main() {
  bounds = textureSize(depths, 0) - 1;
  ivec2 at = ivec2(gl_FragCoord.xy / divisor);
  vec2 place = gl_FragCoord.xy - 0.5 * canvas;
  float t = depth_at(at);
  if (t < 0.0) {
    color = vec4(developed(backdrop(place / (0.5 * min(canvas.x, canvas.y)))), 1);
    return;
  }
  vec3 p = point_at(vec2(at), t), n = normal_at(at, t);
  float turn = fract(52.9829189 * fract(dot(vec2(at) + 64.0 * jitter, vec2(0.06711056, 0.00583715))));
  vec3 albedo = has_traits ? trait_albedo(texelFetch(traits, at, 0).x) : palette_clay;
  float open = open_share(at, p, n, max(3.0, 0.06 * float(bounds.y + 1)), 6.28 * turn);
  // Irradiance from a sky brightest overhead and a floor that glows warmly.
  vec3 sky = mix(vec3(0.267, 0.245, 0.214), vec3(0.59, 0.63, 0.69), 0.5 + 0.5 * dot(n, upright));
  vec3 rim = max(dot(n, rim_direction), 0.0) * vec3(0.488, 0.526, 0.594) * open;
  float cosine = max(dot(n, key_direction), 0.0);
  float seen = cosine > 0.0 ? key_light(p, n, turn) * key_strength : 0.0;
  vec3 view = view_direction(vec2(at) + 0.5 + jitter), key = vec3(1.35, 1.216, 1.026);
  vec3 light = seen * cosine * key + rim + sky * with_bounces(open, albedo);
  color = vec4(developed(0.95 * albedo * light + seen * key * highlight(n, -view, key_direction)), 1);
}
