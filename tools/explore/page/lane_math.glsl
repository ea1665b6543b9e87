// Elementary functions of kernels/lane_math.clh, by the same names. GLSL promises little of its own
// atan, sin and cos: these are the kernels' polynomials. log2 and exp are a GPU's own.

#define QJ_LN2 0.69314718056
#define QJ_PI 3.14159265359
#define QJ_TINY 1e-30
#define QJ_TINY_ROOT 1e-15
#define QJ_TINY_FOURTH 1e-9

float lane_log2(float x) { return log2(x); }

float lane_exp(float x) { return exp(clamp(x, -87.0, 88.0)); }

float lane_rsqrt(float x) { return inversesqrt(x); }

// Angle in [0, pi] of the point (a, rho), rho >= 0, given t, the smaller of |a| and rho over the
// larger, and whether it is steep: rho > |a|. Absolute error 4e-7.
float lane_angle_of(float t, bool steep, float a) {
  float s = t * t;
  float p = s * -4.780454561e-03 + 2.455712110e-02;
  p = s * p - 5.990471318e-02;
  p = s * p + 9.942758829e-02;
  p = s * p - 1.402941942e-01;
  p = s * p + 1.997137517e-01;
  p = s * p - 3.333209455e-01;
  p = p * s * t + t;
  p = steep ? 0.5 * QJ_PI - p : p;
  return a < 0.0 ? QJ_PI - p : p;
}

// sin x and cos x to 1e-7 for |x| < 1000.
float lane_sincos(float x, out float cosine) {
  float n = floor(x * 0.636619772 + 0.5);
  // pi/2 in two parts: the first has few bits, so that n times it is exact.
  float y = (x - n * 1.5703125) - n * 4.83826791e-4;
  float s = y * y;
  float ps = s * -1.950402220e-04 + 8.332036436e-03;
  ps = s * ps - 1.666665077e-01;
  ps = ps * s * y + y;
  float pc = s * 2.460744872e-05 - 1.388897537e-03;
  pc = s * pc + 4.166668653e-02;
  pc = s * pc - 0.5;
  pc = s * pc + 1.0;
  int quadrant = int(n);
  bool odd = (quadrant & 1) != 0;
  float sine = odd ? pc : ps;
  cosine = odd ? ps : pc;
  if (((quadrant + 1) & 2) != 0) cosine = -cosine;
  return (quadrant & 2) != 0 ? -sine : sine;
}
