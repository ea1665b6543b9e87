// The loops that objdump shows of three kernels, written again with intrinsics: multiply-adds (and divisions)
// in a CPU second, over those of a loop that has nothing else.
// gcc -O2 -march=native kernel_loops.c -o kernel_loops && ./kernel_loops   (AVX-512)
#include <immintrin.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
static double cpu(void) {
  struct timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return t.tv_sec + 1e-9 * t.tv_nsec;
}
static float sink;
typedef __m512 V;
static V set(float x) { return _mm512_set1_ps(x); }
static double peak(void) {
  V s[16], a = set(0.999f), b = set(0.001f);
#pragma GCC unroll 16
  for (int i = 0; i < 16; ++i) s[i] = set(i);
  const double start = cpu();
  for (int r = 0; r < 20000000; ++r) {
#pragma GCC unroll 16
    for (int i = 0; i < 16; ++i) s[i] = _mm512_fmadd_ps(s[i], a, b);
    __asm__ volatile("" : "+v"(s[0]));
  }
  const double seconds = cpu() - start;
#pragma GCC unroll 16
  for (int i = 0; i < 16; ++i) sink += _mm512_reduce_add_ps(s[i]);
  return 16.0 * 16 * 20000000 / seconds;
}
enum { kFactors = 992 };
static float cx[kFactors], cy[kFactors], cz[kFactors], cw[kFactors], e[kFactors];
static inline V log_of(V q) {  // exponent and a polynomial of the mantissa
  __m512i t = _mm512_add_epi32(_mm512_castps_si512(q), _mm512_set1_epi32(-0x3f3504f3));
  __m512i k = _mm512_srai_epi32(t, 23);
  V m = _mm512_castsi512_ps(_mm512_sub_epi32(_mm512_castps_si512(q),
                            _mm512_and_si512(t, _mm512_set1_epi32(0xff800000))));
  m = _mm512_add_ps(m, set(-1));
  V p = set(0.1f);
  for (int i = 0; i < 7; ++i) p = _mm512_fmadd_ps(p, m, set(0.1f * (float)(i + 2)));
  return _mm512_fmadd_ps(m, p, _mm512_cvtepi32_ps(k));
}
static double energy(void) {
  const V x = set(0.1f), y = set(0.2f), z = set(0.3f), w = set(0.4f);
  V sum = set(0);
  const int rounds = 60000;
  const double start = cpu();
  for (int r = 0; r < rounds; ++r) {
    for (int i = 0; i < kFactors; ++i) {
      V a = _mm512_sub_ps(set(cx[i]), x), b = _mm512_sub_ps(set(cy[i]), y),
        c = _mm512_sub_ps(set(cz[i]), z), d = _mm512_sub_ps(set(cw[i]), w);
      V q = _mm512_fmadd_ps(d, d, set(1e-9f));
      q = _mm512_fmadd_ps(c, c, q), q = _mm512_fmadd_ps(b, b, q), q = _mm512_fmadd_ps(a, a, q);
      sum = _mm512_fmadd_ps(set(e[i]), log_of(q), sum);
    }
    __asm__ volatile("" : "+v"(sum));
  }
  sink += _mm512_reduce_add_ps(sum);
  return 13.0 * 16 * kFactors * rounds / (cpu() - start);
}
static double gradient(void) {
  const V x = set(0.1f), y = set(0.2f), z = set(0.3f), w = set(0.4f);
  V sum = set(0), gx = set(0), gy = set(0), gz = set(0), gw = set(0);
  float all = 0;
  const int rounds = 40000;
  const double start = cpu();
  for (int r = 0; r < rounds; ++r) {
    for (int i = 0; i < kFactors; ++i) {
      if (e[i] == 0) continue;
      V a = _mm512_sub_ps(set(cx[i]), x), b = _mm512_sub_ps(set(cy[i]), y),
        c = _mm512_sub_ps(set(cz[i]), z), d = _mm512_add_ps(set(cw[i]), w);
      V q = _mm512_fmadd_ps(d, d, set(1e-9f));
      q = _mm512_fmadd_ps(c, c, q), q = _mm512_fmadd_ps(b, b, q), q = _mm512_fmadd_ps(a, a, q);
      const V m = set(e[i]), f = _mm512_div_ps(m, q);
      sum = _mm512_fmadd_ps(m, log_of(q), sum);
      gx = _mm512_fmadd_ps(f, a, gx), gy = _mm512_fmadd_ps(f, b, gy);
      gz = _mm512_fmadd_ps(f, c, gz), gw = _mm512_fmadd_ps(f, d, gw);
      all += e[i];
    }
    __asm__ volatile("" : "+v"(sum), "+v"(gx), "+v"(gy), "+v"(gz), "+v"(gw));
  }
  sink += _mm512_reduce_add_ps(sum + gx + gy + gz + gw) + all;
  return 18.0 * 16 * kFactors * rounds / (cpu() - start);
}
static void tile(const float* left, const float* u, const float* v, int rows) {
  V s[16];
#pragma GCC unroll 16
  for (int i = 0; i < 16; ++i) s[i] = set(0);
  for (int row = 0; row < rows; ++row) {
    const V a = _mm512_loadu_ps(u + 16 * row), b = _mm512_loadu_ps(v + 16 * row);
#pragma GCC unroll 8
    for (int i = 0; i < 8; ++i) {
      const V one = set(left[16 * row + i]);
      s[2 * i] = _mm512_fmadd_ps(a, one, s[2 * i]);
      s[2 * i + 1] = _mm512_fmadd_ps(b, one, s[2 * i + 1]);
    }
  }
#pragma GCC unroll 16
  for (int i = 0; i < 16; ++i) sink += s[i][0];
}
/// The upper triangle of P^T P for panels of 16 columns and so many rows, in the kernel's order: two panels stay
/// while the eight numbers go through half a panel after the other.
static double panels(int rows, int tiles, int times) {
  const size_t floats = (size_t)rows * 16;
  float* const p = aligned_alloc(64, sizeof(float) * floats * (size_t)tiles);
  for (size_t i = 0; i < floats * (size_t)tiles; ++i) p[i] = 0.001f;
  double done = 0;
  const double start = cpu();
  for (int time = 0; time < times; ++time) {
    for (int column = 0; column < tiles; column += 2) {
      for (int half = 0; half < 2 * (column + 2); ++half) {
        tile(p + floats * (size_t)(half / 2) + 8 * (half % 2), p + floats * (size_t)column,
             p + floats * (size_t)(column + 1), rows);
        done += 16.0 * 16 * rows;
      }
    }
  }
  const double rate = done / (cpu() - start);
  free(p);
  return rate;
}
int main(void) {
  for (int i = 0; i < kFactors; ++i) {
    cx[i] = 0.001f * i, cy[i] = 0.3f, cz[i] = 0.2f, cw[i] = 0.1f, e[i] = 0.01f + 1e-5f * i;
  }
  for (int turn = 0; turn < 3; ++turn) {
    const double most = peak();
    printf("peak %.1f G/s; energy_terms %.1f %%, gradient_potential %.1f %%, panels: L1 %.1f %%, "
           "as in a fit %.1f %%\n", 1e-9 * most, 100 * energy() / most, 100 * gradient() / most,
           100 * panels(128, 2, 20000) / most, 100 * panels(1024, 310, 1) / most);
  }
  return sink == 12345;
}
