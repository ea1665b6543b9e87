// F = S + sum_k a_k ln |q - c_k|: kernels/factors_modulus.clh.
#include factors.glsl

vec4 norms2(vec4 q, int g) {
  vec4 a = q - CENTER(4 * g), b = q - CENTER(4 * g + 1), c = q - CENTER(4 * g + 2),
       d = q - CENTER(4 * g + 3);
  return vec4(dot(a, a), dot(b, b), dot(c, c), dot(d, d)) + QJ_TINY;
}

float kind_modulus(vec4 q) {
  float sum = 0.0;
  for (int g = 0; g < groups; ++g) sum += dot(EXPONENTS(g), log2(norms2(q, g)));
  return map_scaled_log(sum);
}

// The nearest point where F is not smooth is the nearest centre.
float kind_modulus_near(vec4 q, out float nearest) {
  float sum = 0.0, nearest2 = 1e30;
  for (int g = 0; g < groups; ++g) {
    vec4 n = norms2(q, g);
    sum += dot(EXPONENTS(g), log2(n));
    nearest2 = min(nearest2, min(min(n.x, n.y), min(n.z, n.w)));
  }
  nearest = sqrt(nearest2);
  return map_scaled_log(sum);
}
