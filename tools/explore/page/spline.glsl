// A triquadratic B-spline: kernels/spline.clh.
vec3 spline_weights(float t) {
  float a = 0.5 - t, b = 0.5 + t;
  return vec3(0.5 * a * a, 0.75 - t * t, 0.5 * b * b);
}
vec3 spline_slopes(float t) { return vec3(t - 0.5, -2.0 * t, t + 0.5); }

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

// The same with its gradient: value, then by u, v and w.
vec4 spline_gradient_at(highp sampler3D coefficients, vec3 u) {
  ivec3 cell = ivec3(u);
  vec3 t = u - vec3(cell) - 0.5;
  vec3 wx = spline_weights(t.x), wy = spline_weights(t.y), wz = spline_weights(t.z);
  vec3 dx = spline_slopes(t.x), dy = spline_slopes(t.y), dz = spline_slopes(t.z);
  vec4 sum = vec4(0);
  for (int k = 0; k < 3; ++k) {
    for (int j = 0; j < 3; ++j) {
      vec3 row = spline_row(coefficients, cell + ivec3(0, j - 1, k - 1));
      float a = dot(wx, row);
      sum += vec4(wz[k] * wy[j] * a, wz[k] * wy[j] * dot(dx, row), wz[k] * dy[j] * a, dz[k] * wy[j] * a);
    }
  }
  return sum;
}
