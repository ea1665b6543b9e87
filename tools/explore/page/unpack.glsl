// The numbers of a file's grid, one a pixel: host/map/kinds/distance_modulus.cpp packs their differences. A draw
// takes them out of the file's bytes; others, with doubled strides, add up what came before.
#define DIFFERENCES 0  // of a list of 16-bit numbers: all low bytes, then all high ones
#define BITS 1         // the first in the lowest bit of the first byte

uniform highp usampler2D file_bytes;
uniform highp isampler2D sums;
uniform int kind, first, count;  // of the file's bytes, and of the numbers
uniform int stride;              // 0: from the file's bytes
out ivec4 result;

ivec2 pixel_of(int i) { return ivec2(i & 4095, i >> 12); }
int byte_at(int i) { return int(texelFetch(file_bytes, pixel_of(first + i), 0).x); }
int sum_at(int i) { return texelFetch(sums, pixel_of(i), 0).x; }

void main() {
  int i = int(gl_FragCoord.y) * 4096 + int(gl_FragCoord.x);
  if (i >= count) {
    result = ivec4(0);
  } else if (stride > 0) {
    result = ivec4(sum_at(i) + (i >= stride ? sum_at(i - stride) : 0));
  } else if (kind == BITS) {
    result = ivec4((byte_at(i >> 3) >> (i & 7)) & 1);
  } else {
    result = ivec4(byte_at(i) | (byte_at(count + i) << 8));
  }
}
