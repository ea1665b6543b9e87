// A coarse spline on cells a quarter as long (Chaikin 1974, twice): weights of the coefficients
// before, at and after a coarse cell, by which quarter of it is meant.
vec3 quarter_weights(int quarter) {
  if (quarter == 0) return vec3(0.375, 0.625, 0);
  if (quarter == 1) return vec3(0.1875, 0.75, 0.0625);
  if (quarter == 2) return vec3(0.0625, 0.75, 0.1875);
  return vec3(0, 0.625, 0.375);
}

int sum_of(highp isampler2D sums, int i) { return texelFetch(sums, ivec2(i & 4095, i >> 12), 0).x; }
// Sums of unpack.glsl are whole numbers modulo 2^16.
float number_of(highp isampler2D sums, int i) { return float(sum_of(sums, i) << 16 >> 16); }

uniform ivec3 coarse_cells;
int block_of(ivec3 at) { return (at.z * coarse_cells.y + at.y) * coarse_cells.x + at.x; }
