// What colours each pixel by its orbit, 0 ... 1: kernels/orbit_trait.cl.
#include map.glsl
#include view.glsl

uniform highp sampler2D depths;
uniform vec2 jitter;
uniform float footprint;
uniform int iterations;
uniform bool trap;
out vec4 result;

void main() {
  float t = texelFetch(depths, ivec2(gl_FragCoord.xy), 0).x;
  if (t < 0.0) discard;
  // A pixel behind the surface: on it, orbits part.
  vec4 q = vec4(eye + (t + footprint) * view_direction(gl_FragCoord.xy + jitter), map_slice);
  float above = min(map_log_escape, map_log_outer), later = 0.0, closest = 1.0;
  for (int i = 0; i < iterations; ++i) {
    float f = map_modulus(q);
    if (i > 0) later += 1.0;
    q = map_image(q, f);
    if (i < 2) closest = min(closest, abs(q.x) * lane_rsqrt(max(dot(q, q), QJ_TINY)));
    if (f >= above || f <= map_log_inner) break;
  }
  result = vec4(trap ? closest : later / float(max(iterations - 1, 1)));
}
