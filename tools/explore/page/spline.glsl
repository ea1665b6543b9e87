// A triquadratic B-spline: kernels/spline.clh.
vec3 spline_weights(float t) {
  float a = 0.5 - t, b = 0.5 + t;
  return vec3(0.5 * a * a, 0.75 - t * t, 0.5 * b * b);
}

// Three coefficients along x.
vec3 spline_row(highp sampler3D coefficients, ivec3 at) {
  return vec3(texelFetch(coefficients, at - ivec3(1, 0, 0), 0).x, texelFetch(coefficients, at, 0).x,
              texelFetch(coefficients, at + ivec3(1, 0, 0), 0).x);
}

// The spline at a point of its domain, in cells.
float spline_at(highp sampler3D coefficients, vec3 u) {
  ivec3 cell = ivec3(u);
  vec3 t = u - vec3(cell) - 0.5;
  vec3 wx = spline_weights(t.x), wy = spline_weights(t.y), wz = spline_weights(t.z);
  float sum = 0.0;
  for (int k = 0; k < 3; ++k) {
    for (int j = 0; j < 3; ++j) {
      sum += wz[k] * wy[j] * dot(wx, spline_row(coefficients, cell + ivec3(0, j - 1, k - 1)));
    }
  }
  return sum;
}

