// U = p (q^2 + c) / |q^2 + c|: kernels/quadratic_versor.clh.
uniform vec4 versor_c;

vec4 map_versor(vec4 q) {
  vec4 g = q_square_plus(q, versor_c);
  return lane_rsqrt(max(dot(g, g), QJ_TINY)) * q_mul(map_phase, g);
}
