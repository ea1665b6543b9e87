// The map's factors in their order, in groups of four; those that fill up the last have exponent 0.
#if FACTORS_IN_BLOCK
layout(std140) uniform Factors {
  vec4 exponents[GROUPS];
  vec4 centers[4 * GROUPS];
};
#define EXPONENTS(g) exponents[g]
#define CENTER(k) centers[k]
#else
uniform sampler2D factors;  // exponents, then centres
#define FACTOR_TEXEL(i) texelFetch(factors, ivec2((i) & 255, (i) >> 8), 0)
#define EXPONENTS(g) FACTOR_TEXEL(g)
#define CENTER(k) FACTOR_TEXEL(GROUPS + (k))
#endif
// A loop whose bound is no constant is not unrolled: some compilers would take minutes.
uniform int groups;
