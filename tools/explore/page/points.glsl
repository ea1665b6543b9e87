// What the map is at given points: a pixel for a point.
#include map.glsl

#define FIELD 0     // F_n, and F_1 of the plain map
#define VERSOR 1    // U
#define GRADIENT 2  // derivatives of F_1 by X, Y, Z; and F_1
#define CROSSING 3  // along a direction: the first radius at which F_1 crosses the level

uniform highp sampler2D points;
uniform int wanted, iterations;
uniform float limit;  // the largest radius
out vec4 result;

// The first of 128 steps that leaves {F_1 < L}, halved: host/map/calibration.cpp.
float first_crossing(vec4 direction) {
  float low = limit, high = limit;
  for (int i = 0; i <= 128; ++i) {
    float radius = limit * float(i) / 128.0;
    if (plain_modulus(radius * direction) < map_surface_level) continue;
    low = limit * float(max(i - 1, 0)) / 128.0, high = radius;
    break;
  }
  for (int i = 0; i < 16; ++i) {
    float middle = 0.5 * (low + high);
    if (plain_modulus(middle * direction) < map_surface_level) low = middle;
    else high = middle;
  }
  return high;
}

void main() {
  vec4 q = texelFetch(points, ivec2(gl_FragCoord.xy), 0);
  if (wanted == VERSOR) result = map_versor(q);
  else if (wanted == GRADIENT) result = vec4(plain_modulus_gradient(q).xyz, plain_modulus(q));
  else if (wanted == CROSSING) result = vec4(first_crossing(q));
  else result = vec4(map_iterate(q, iterations), plain_modulus(q), 0, 0);
}
