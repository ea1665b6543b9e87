// A layer of the coarse cells of a file's grid, on cells a quarter as long along x and y.
#include quarters.glsl
uniform highp isampler2D coarse;
uniform int layer;
out vec4 result;

void main() {
  ivec3 at = ivec3(gl_FragCoord.xy, 4 * layer), cell = at >> 2;
  vec3 wx = quarter_weights(at.x & 3), wy = quarter_weights(at.y & 3);
  float sum = 0.0;
  for (int j = 0; j < 3; ++j) {
    for (int i = 0; i < 3; ++i) {
      ivec3 near = clamp(cell + ivec3(i, j, 1) - 1, ivec3(0), coarse_cells - 1);
      sum += wx[i] * wy[j] * number_of(coarse, block_of(near));
    }
  }
  result = vec4(sum / 64.0);
}
