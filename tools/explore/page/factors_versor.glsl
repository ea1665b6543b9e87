// U = p prod_k (cos a_k t_k, n_k sin a_k t_k): kernels/factors_versor.clh and factor_walk.clh.
#include factors.glsl

vec4 factor_versor(vec4 d, float a) {
  // Where v = 0 it becomes a tiny multiple of i: the versor must be unit on the branch cut too.
  d.y += d.y < 0.0 ? -QJ_TINY_FOURTH : QJ_TINY_FOURTH;
  float r2 = dot(d.yzw, d.yzw), x = max(abs(d.x), QJ_TINY_FOURTH), x2 = x * x;
  float s = lane_rsqrt(r2 * x2);
  float angle = lane_angle_of(s * min(r2, x2), r2 > x2, d.x);
  float cosine, sine = lane_sincos(angle * a, cosine);
  return vec4(cosine, sine * s * x * d.yzw);
}

vec4 map_versor(vec4 q) {
  vec4 u = map_phase;
  for (int g = 0; g < groups; ++g) {
    vec4 a = VERSOR_SHARPNESS * EXPONENTS(g);
    for (int j = 0; j < 4; ++j) u = q_mul(u, factor_versor(q - CENTER(4 * g + j), a[j]));
  }
  return normalize(u);
}
