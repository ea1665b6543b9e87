// A layer of a spline's coefficients on a file's grid, cells: DistanceGrid::expand. The coarse
// spline on cells a quarter as long (Chaikin 1974, twice), and what it misses near the surface.
uniform highp isampler2D coarse, ranks, corrections;  // of unpack.glsl
uniform ivec3 coarse_cells;
uniform int layer;
out vec4 result;

int sum_of(highp isampler2D sums, int i) { return texelFetch(sums, ivec2(i & 4095, i >> 12), 0).x; }
// Sums are whole numbers modulo 2^16.
float number_of(highp isampler2D sums, int i) { return float(sum_of(sums, i) << 16 >> 16); }
int block_of(ivec3 at) { return (at.z * coarse_cells.y + at.y) * coarse_cells.x + at.x; }

// Weights of three coarse coefficients by which quarter of the middle one's cell is meant.
vec3 quarter_weights(int quarter) {
  if (quarter == 0) return vec3(0.375, 0.625, 0);
  if (quarter == 1) return vec3(0.1875, 0.75, 0.0625);
  if (quarter == 2) return vec3(0.0625, 0.75, 0.1875);
  return vec3(0, 0.625, 0.375);
}

void main() {
  ivec3 at = ivec3(gl_FragCoord.xy, layer), cell = at >> 2, part = at & 3;
  vec3 wx = quarter_weights(part.x), wy = quarter_weights(part.y), wz = quarter_weights(part.z);
  float sum = 0.0;
  for (int k = 0; k < 3; ++k) {
    for (int j = 0; j < 3; ++j) {
      for (int i = 0; i < 3; ++i) {
        ivec3 near = clamp(cell + ivec3(i, j, k) - 1, ivec3(0), coarse_cells - 1);
        sum += wx[i] * wy[j] * wz[k] * number_of(coarse, block_of(near));
      }
    }
  }
  sum /= 64.0;
  // A block that has corrections is one more than the one before.
  int block = block_of(cell), rank = sum_of(ranks, block);
  if (rank > (block > 0 ? sum_of(ranks, block - 1) : 0)) {
    int place = (part.z * 4 + part.y) * 4 + part.x;
    sum += number_of(corrections, 64 * (rank - 1) + place) / 256.0;
  }
  result = vec4(sum);
}
