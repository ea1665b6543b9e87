// A layer of the grid: the file's F_1 - L, and the distance to the nearest point where F_1 is not
// smooth.
#include map.glsl

uniform vec3 low, high, cells;  // a box and how many cells it has
uniform float layer;
out vec4 result;

void main() {
  float nearest;
  vec3 p = mix(low, high, vec3(gl_FragCoord.xy - 0.5, layer) / cells);
  float f = kind_modulus_near(vec4(p, map_slice), nearest);
  result = vec4(clamp(f - map_file_level, -6e4, 6e4), min(nearest, 6e4), 0, 0);
}
