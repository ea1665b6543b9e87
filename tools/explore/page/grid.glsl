// A layer of the grid: F_1 - L, and the distance to the nearest point where F_1 is not smooth.
#include map.glsl

uniform vec3 low, cell;
uniform float layer;
out vec4 result;

void main() {
  float nearest;
  float f = kind_modulus_near(vec4(low + cell * vec3(gl_FragCoord.xy - 0.5, layer), map_slice), nearest);
  result = vec4(clamp(f - map_surface_level, -6e4, 6e4), min(nearest, 6e4), 0, 0);
}
