// What the map is at given points: a pixel for a point.
#include map.glsl

uniform highp sampler2D points;
uniform int iterations;  // of F_n; 0: U
out vec4 result;

void main() {
  vec4 q = texelFetch(points, ivec2(gl_FragCoord.xy), 0);
  result = iterations == 0 ? map_versor(q) : vec4(map_iterate(q, iterations));
}
