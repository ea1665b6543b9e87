// Developed colours as sRGB, rounded by a fixed pattern that hides steps: kernels/develop.cl.
uniform highp sampler2D picture;
out vec4 color;

vec3 srgb_encode(vec3 c) {
  return mix(1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, 12.92 * c, lessThanEqual(c, vec3(0.0031308)));
}

void main() {
  uint h = uint(gl_FragCoord.x) * 1973u + uint(gl_FragCoord.y) * 9277u;
  h = (h ^ (h >> 13)) * 1274126177u;
  float dither = float((h ^ (h >> 16)) & 0xffffu) / 65536.0 - 0.5;
  vec3 c = texelFetch(picture, ivec2(gl_FragCoord.xy), 0).rgb;
  color = vec4(srgb_encode(max(c, 0.0)) + dither / 255.0, 1);
}
