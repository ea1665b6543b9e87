// F = S + ln |q^2 + c|: kernels/quadratic_modulus.clh.
uniform vec4 modulus_c;

float kind_modulus(vec4 q) {
  vec4 g = q_square_plus(q, modulus_c);
  return map_scaled_log(lane_log2(max(dot(g, g), QJ_TINY)));
}

// Its zeros lie inside the set, where no ray goes.
float kind_modulus_near(vec4 q, out float nearest) {
  nearest = 1e15;
  return kind_modulus(q);
}
