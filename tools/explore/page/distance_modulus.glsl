// F = S + d4(q) / delta with d the signed distance by a spline on a grid: kernels/distance_modulus.clh.
#include spline.glsl
#define QJ_DISTANCE_MARGIN 4.0
uniform highp sampler3D coefficients;
uniform float distance_shell, distance_inradius, distance_step;
uniform int distance_fourth;  // 0: round, 1: ignored
uniform vec3 distance_origin, distance_cells;

// A point's place on the grid, in cells, and the way from there to it, map units.
vec3 place_on_grid(vec4 q, out vec3 beyond) {
  vec3 u = (q.xyz - distance_origin) / distance_step;
  vec3 inside = clamp(u, vec3(QJ_DISTANCE_MARGIN), distance_cells - QJ_DISTANCE_MARGIN);
  beyond = (u - inside) * distance_step;
  return inside;
}

// F of a point whose d + r_in is `depth`.
float distance_field(float depth, vec4 q) {
  float radius = sqrt(depth * depth + float(1 - distance_fourth) * q.w * q.w);
  return (radius - distance_inradius) / distance_shell + map_log_scale;
}

float kind_modulus(vec4 q) {
  vec3 beyond, u = place_on_grid(q, beyond);
  return distance_field(spline_at(coefficients, u) * distance_step + length(beyond) + distance_inradius, q);
}

// F has a slope everywhere.
float kind_modulus_near(vec4 q, out float nearest) {
  nearest = 1e15;
  return kind_modulus(q);
}
