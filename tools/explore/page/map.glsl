// The map R(q) = e^F(q) U(q): kernels/map.clh, function by function. QJ_MODULUS, QJ_VERSOR, QJ_PAINT
// and QJ_PORTALS are the files of its kinds.
#include lane_math.glsl
#include quaternion.glsl

#include map_values.glsl

// S + ln x, from log2 x^2.
float map_scaled_log(float log2_x2) { return log2_x2 * (0.5 * QJ_LN2) + map_log_scale; }

#include QJ_MODULUS
#include QJ_VERSOR
#include knobs.glsl

// L + k (f - L) where f > L, else f.
float map_steep(float f) { return f + (map_steepness - 1.0) * max(f - map_surface_level, 0.0); }

#include QJ_PAINT

float plain_modulus(vec4 q) { return painted(map_steep(map_turned(kind_modulus(q))), q); }

float plain_safe_step(vec4 q, float far_level, float steepest) {
  float nearest, f = map_steep(map_turned(kind_modulus_near(q, nearest)));
  return min((f - far_level) / steepest, nearest);
}

// ln of the distance from the origin, the F of a point no iterate was run on.
float map_log_radius(vec4 q) {
  q -= map_origin();
  return 0.5 * QJ_LN2 * lane_log2(max(dot(q, q), QJ_TINY));
}

// The image of q, whose F is f.
vec4 plain_image(vec4 q, float f) { return map_origin() + lane_exp(min(f, 40.0)) * map_versor(q); }

#include QJ_PORTALS

// F_n: the F of the last executed iterate.
float map_iterate(vec4 q, int n) {
  float f = map_log_radius(q);
  if (!(f < map_log_escape)) return f;
  for (int i = 0; i < n; ++i) {
    f = map_modulus(q);
    if (i + 1 == n || f >= map_log_escape) break;
    q = map_image(q, f);
  }
  return f;
}
