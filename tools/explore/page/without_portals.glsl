// A map without portals: kernels/without_portals.clh.
float map_modulus(vec4 q) { return plain_modulus(q); }

vec4 map_image(vec4 q, float f) { return plain_image(q, f); }

// How far the band {F_1 < far_level} is at least, given what that is without portals.
float map_safe_step(vec4 q, int iterations, float far_level, float steepest, float plain) {
  return plain;
}
