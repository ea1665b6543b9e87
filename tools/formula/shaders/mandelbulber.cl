// The kernels' polynomials, by the names of kernels/lane_math.clh. Absolute error 4e-7.
float qj_angle_of(float t, bool steep, float a) {
  float s = t * t;
  float p = s * -4.780454561e-03f + 2.455712110e-02f;
  p = s * p - 5.990471318e-02f;
  p = s * p + 9.942758829e-02f;
  p = s * p - 1.402941942e-01f;
  p = s * p + 1.997137517e-01f;
  p = s * p - 3.333209455e-01f;
  p = p * s * t + t;
  p = steep ? 0.5f * M_PI_F - p : p;
  return a < 0.0f ? M_PI_F - p : p;
}

// Hamilton's product p q of quaternions X + Y i + Z j + W k.
float4 qj_mul(float4 p, float4 q) {
  return (float4)(p.x * q.x - p.y * q.y - p.z * q.z - p.w * q.w,
                  p.x * q.y + p.y * q.x + p.z * q.w - p.w * q.z,
                  p.x * q.z - p.y * q.w + p.z * q.x + p.w * q.y,
                  p.x * q.w + p.y * q.z - p.z * q.y + p.w * q.x);
}

// F = S + sum_k a_k ln |q - c_k|, and the distance of the nearest centre.
float qj_modulus(float4 q, float* nearest) {
  float sum = 0.0f, nearest2 = 1e30f;
  for (int k = 0; k < QJ_FACTORS; ++k) {
    float4 d = q - qj_centers[k];
    float d2 = dot(d, d) + 1e-30f;
    sum += qj_exponents[k] * log2(d2);
    nearest2 = min(nearest2, d2);
  }
  *nearest = sqrt(nearest2);
  return sum * (0.5f * M_LN2_F) + QJ_LOG_SCALE;
}

// U = p prod_k (cos a_k t_k, n_k sin a_k t_k).
float4 qj_versor(float4 q, float4 phase) {
  float4 u = phase;
  for (int k = 0; k < QJ_FACTORS; ++k) {
    float4 d = q - qj_centers[k];
    // Where v = 0 it becomes a tiny multiple of i: the versor is unit on the branch cut too.
    d.y += d.y < 0.0f ? -1e-9f : 1e-9f;
    float r2 = dot(d.yzw, d.yzw), x = max(fabs(d.x), 1e-9f), x2 = x * x;
    float s = rsqrt(r2 * x2), cosine;
    float angle = qj_angle_of(s * min(r2, x2), r2 > x2, d.x);
    float sine = sincos(angle * qj_exponents[k], &cosine);
    u = qj_mul(u, (float4)(cosine, sine * s * x * d.yzw));
  }
  return normalize(u);
}

// An iterate z -> R(z) = e^F(z) U(z), so that ln |z| is F. Of the first, z is a point of the
// picture: x to the right, y to the back, z upwards, the shape's box about the origin and 2 long.
//
// DE is such that |z| / DE is no more than the distance to the set: F falls towards the band of
// undecided points no faster than QJ_STEEPEST a unit, and an iterate stretches a short way by no
// more than e^F QJ_STEEPEST / ln 2. Two members of aux that no part of the program uses with
// formulas of this kind keep what is known from iterate to iterate: dist the longest safe way, and
// pos_neg the way in the picture that one unit of way at the present iterate stands for.
// Mandelbulber replaces parts of the next line, and finds them by their spaces.
// clang-format off
REAL4 CustomIteration(REAL4 z, __constant sFractalCl *fractal, sExtendedAuxCl *aux) {
  // clang-format on
  float slice = fractal->transformCommon.offset0;
  float steepness = fractal->transformCommon.scale1;
  float finest = fractal->transformCommon.offset0005;
  float ax = fractal->transformCommon.rotation.x * (M_PI_F / 180.0f);
  float ay = fractal->transformCommon.rotation.y * (M_PI_F / 180.0f);
  float az = fractal->transformCommon.rotation.z * (M_PI_F / 180.0f);
  // cos A + sin A (i cos B + j sin B cos C + k sin B sin C).
  float4 phase = (float4)(cos(ax), sin(ax) * cos(ay), sin(ax) * sin(ay) * cos(az),
                          sin(ax) * sin(ay) * sin(az));
  float slope = QJ_STEEPEST * steepness, slow = M_LN2_F / slope, nearest, beyond = 0.0f;
  float4 q = convert_float4(z);
  if (aux->i == 0) {
    q = QJ_FRAME_SCALE * (q.x * QJ_RIGHT + q.z * QJ_UP - q.y * QJ_FRONT) + QJ_FRAME_CENTER;
    q.w = slice;
    beyond = length(q.xyz) - QJ_BALL_RADIUS;
  }
  float f = qj_modulus(q, &nearest);
  f += (steepness - 1.0f) * max(f - QJ_SURFACE_LEVEL, 0.0f);
  float most = aux->i == 0 ? nearest : aux->dist, per_way = aux->i == 0 ? 1.0f : aux->pos_neg;

  float way = f < QJ_SURFACE_LEVEL ? 0.0f : finest;
  if (f >= QJ_FAR_LEVEL) {
    float safe = min(most, per_way * (f - QJ_FAR_LEVEL) / slope);
    if (beyond > 0.25f * QJ_BALL_RADIUS) safe = beyond;
    way = max(safe / QJ_FRAME_SCALE, finest);
  }
  float radius = exp(clamp(f, -80.0f, 40.0f));
  aux->DE = way > 0.0f ? radius / way : 1e20f;
  aux->dist = min(most, per_way * slow);
  aux->pos_neg = min(per_way * slow * exp(clamp(-f, -80.0f, 80.0f)), 1e15f);
  float4 image = radius * qj_versor(q, phase);
  return (REAL4)(image.x, image.y, image.z, image.w);
}
