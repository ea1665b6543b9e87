// A layer of a spline's coefficients on a file's grid, cells: DistanceGrid::expand. The coarse
// spline, and what it misses near the surface.
#include quarters.glsl
uniform highp sampler3D widened;  // of widened.glsl
uniform highp isampler2D ranks, corrections;
uniform int layer;
out vec4 result;

void main() {
  ivec3 at = ivec3(gl_FragCoord.xy, layer), cell = at >> 2, part = at & 3;
  vec3 w = quarter_weights(part.z);
  float sum = 0.0;
  for (int k = 0; k < 3; ++k) {
    sum += w[k] * texelFetch(widened, ivec3(at.xy, clamp(cell.z + k - 1, 0, coarse_cells.z - 1)), 0).x;
  }
  // A block that has corrections is one more than the one before.
  int block = block_of(cell), rank = sum_of(ranks, block);
  if (rank > (block > 0 ? sum_of(ranks, block - 1) : 0)) {
    int place = (part.z * 4 + part.y) * 4 + part.x;
    sum += number_of(corrections, 64 * (rank - 1) + place) / 256.0;
  }
  result = vec4(sum);
}
