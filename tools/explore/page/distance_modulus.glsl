// F = S + d4(q) / delta with d the signed distance by a spline on a grid: kernels/distance_modulus.clh.
#define QJ_DISTANCE_MARGIN 4.0
uniform highp sampler3D coefficients;
uniform float distance_per_shell, distance_inradius, distance_fourth, distance_step;
uniform vec3 distance_origin, distance_cells;

vec3 spline_weights(float t) {
  float a = 0.5 - t, b = 0.5 + t;
  return vec3(0.5 * a * a, 0.75 - t * t, 0.5 * b * b);
}
vec3 spline_slopes(float t) { return vec3(t - 0.5, -2.0 * t, t + 0.5); }

// Three coefficients along x.
vec3 spline_row(ivec3 at) {
  return vec3(texelFetch(coefficients, at - ivec3(1, 0, 0), 0).x, texelFetch(coefficients, at, 0).x,
              texelFetch(coefficients, at + ivec3(1, 0, 0), 0).x);
}

// The spline at a point of its domain, in cells.
float spline_at(vec3 u) {
  ivec3 cell = ivec3(u);
  vec3 t = u - vec3(cell) - 0.5;
  vec3 wx = spline_weights(t.x), wy = spline_weights(t.y), wz = spline_weights(t.z);
  float sum = 0.0;
  for (int k = 0; k < 3; ++k) {
    for (int j = 0; j < 3; ++j) {
      sum += wz[k] * wy[j] * dot(wx, spline_row(cell + ivec3(0, j - 1, k - 1)));
    }
  }
  return sum;
}

// The same with its gradient: value, then by u, v and w.
vec4 spline_gradient_at(vec3 u) {
  ivec3 cell = ivec3(u);
  vec3 t = u - vec3(cell) - 0.5;
  vec3 wx = spline_weights(t.x), wy = spline_weights(t.y), wz = spline_weights(t.z);
  vec3 dx = spline_slopes(t.x), dy = spline_slopes(t.y), dz = spline_slopes(t.z);
  vec4 sum = vec4(0);
  for (int k = 0; k < 3; ++k) {
    for (int j = 0; j < 3; ++j) {
      vec3 row = spline_row(cell + ivec3(0, j - 1, k - 1));
      float a = dot(wx, row);
      sum += vec4(wz[k] * wy[j] * a, wz[k] * wy[j] * dot(dx, row), wz[k] * dy[j] * a, dz[k] * wy[j] * a);
    }
  }
  return sum;
}

// A point's place on the grid, in cells, and the way from there to it, map units.
vec3 place_on_grid(vec4 q, out vec3 beyond) {
  vec3 u = (q.xyz - distance_origin) / distance_step;
  vec3 inside = clamp(u, vec3(QJ_DISTANCE_MARGIN), distance_cells - QJ_DISTANCE_MARGIN);
  beyond = (u - inside) * distance_step;
  return inside;
}

// F of a point whose d + r_in is `depth`.
float distance_field(float depth, vec4 q) {
  float radius = sqrt(depth * depth + distance_fourth * q.w * q.w);
  return (radius - distance_inradius) * distance_per_shell + map_log_scale;
}

float kind_modulus(vec4 q) {
  vec3 beyond, u = place_on_grid(q, beyond);
  return distance_field(spline_at(u) * distance_step + length(beyond) + distance_inradius, q);
}

vec4 kind_modulus_gradient(vec4 q) {
  vec3 beyond, u = place_on_grid(q, beyond);
  vec4 found = spline_gradient_at(u);
  float far = length(beyond), depth = found.x * distance_step + far + distance_inradius;
  // Beyond the domain the way grows, and along its axes the spline does not change.
  vec3 g = mix(beyond / max(far, QJ_TINY_ROOT), found.yzw, equal(beyond, vec3(0)));
  float kw = distance_fourth * q.w, radius = sqrt(depth * depth + kw * q.w);
  return distance_per_shell / max(radius, QJ_TINY_ROOT) * vec4(depth * g, kw);
}

// F has a slope everywhere.
float kind_modulus_near(vec4 q, out float nearest) {
  nearest = 1e15;
  return kind_modulus(q);
}
