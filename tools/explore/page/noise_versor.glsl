// U = p n / |n| with n gradient noise by octaves: kernels/noise_versor.clh.
#define QJ_MOST_NOISE_CELLS 1e6
uniform int noise_octaves, noise_values;  // values: the number of components
uniform float noise_scale;
uniform uint noise_seed;
uniform vec3 noise_origin;

float noise_corner(uint hash, vec3 way) {
  hash ^= hash >> 16;
  hash *= 0x85ebca6bu;
  hash ^= hash >> 13;
  hash *= 0xc2b2ae35u;
  hash ^= hash >> 16;
  vec3 gradient = vec3(float(hash & 1023u), float((hash >> 10) & 1023u),
                       float((hash >> 20) & 1023u));
  return dot((gradient - 511.5) / 512.0, way);
}

vec3 noise_fade(vec3 t) { return t * t * t * (t * (t * 6.0 - 15.0) + 10.0); }

float noise_at(vec3 p, uint salt) {
  p = clamp(p, -QJ_MOST_NOISE_CELLS, QJ_MOST_NOISE_CELLS);
  vec3 cell = floor(p);
  uvec3 h = uvec3(ivec3(cell)) * uvec3(0x8da6b343u, 0xd8163841u, 0xcb1ab31fu);
  uvec3 g = h + uvec3(0x8da6b343u, 0xd8163841u, 0xcb1ab31fu);
  p -= cell;
  vec3 u = noise_fade(p);
  float sum[2];
  for (int layer = 0; layer < 2; ++layer) {
    uint z = layer == 0 ? h.z : g.z;
    vec3 q = vec3(p.xy, p.z - float(layer));
    float near = mix(noise_corner(h.x ^ h.y ^ z ^ salt, q),
                     noise_corner(g.x ^ h.y ^ z ^ salt, q - vec3(1, 0, 0)), u.x);
    float far = mix(noise_corner(h.x ^ g.y ^ z ^ salt, q - vec3(0, 1, 0)),
                    noise_corner(g.x ^ g.y ^ z ^ salt, q - vec3(1, 1, 0)), u.x);
    sum[layer] = mix(near, far, u.y);
  }
  return mix(sum[0], sum[1], u.z);
}

float noise_component(vec3 at, int component) {
  float frequency = noise_scale, strength = 1.0, shift = 0.37 * float(component), sum = 0.0;
  for (int octave = 0; octave < noise_octaves; ++octave) {
    uint salt = (noise_seed * 8u + uint(octave)) * 4u + uint(component);
    sum += strength * noise_at(at * frequency + shift, salt * 0x9e3779b9u);
    frequency *= 2.0;
    strength *= 0.5;
  }
  return sum;
}

vec4 map_versor(vec4 q) {
  vec3 at = q.xyz - noise_origin;
  vec4 n = vec4(noise_component(at, 0), noise_component(at, 1), noise_component(at, 2), 0);
  if (noise_values > 3) n.w = noise_component(at, 3);
  return lane_rsqrt(max(dot(n, n), QJ_TINY)) * q_mul(map_phase, n);
}
