// Quaternions X + Y i + Z j + W k as vec4: kernels/quaternion.clh.

// Hamilton's product p q.
vec4 q_mul(vec4 p, vec4 q) {
  return vec4(p.x * q.x - p.y * q.y - p.z * q.z - p.w * q.w,
              p.x * q.y + p.y * q.x + p.z * q.w - p.w * q.z,
              p.x * q.z - p.y * q.w + p.z * q.x + p.w * q.y,
              p.x * q.w + p.y * q.z - p.z * q.y + p.w * q.x);
}

// q^2 + c.
vec4 q_square_plus(vec4 q, vec4 c) {
  float twice = 2.0 * q.x;
  return vec4(q.x * q.x - dot(q.yzw, q.yzw) + c.x, twice * q.yzw + c.yzw);
}
