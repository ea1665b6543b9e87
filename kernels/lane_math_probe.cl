// For conformance tests only: the functions of lane_math.clh on arrays, to be swept against the
// host's.

#include "lane_math.clh"

// out[i] = the function numbered `function` of x[i] (and y[i], where it takes two). Arrays of
// groups * QJ_WIDTH reals; one work-item per QJ_WIDTH of them.
kernel void lane_math_probe(global const real* x, global const real* y, int groups, int function,
                            global real* out) {
  int g = (int)get_global_id(0);
  if (g >= groups) return;
  lane u = lane_load(x, g);
  lane v = lane_load(y, g);
  lane result = u;
  lane cosine;
  switch (function) {
    case 0:
      result = lane_log2(u);
      break;
    case 1:
      result = lane_exp(u);
      break;
    case 2:
      result = lane_tanh(u);
      break;
    case 3:
      result = lane_angle(u, v);
      break;
    case 4:
      result = lane_sincos(u, &cosine);
      break;
    case 5:
      lane_sincos(u, &cosine);
      result = cosine;
      break;
    case 6:
      result = lane_rsqrt(u);
      break;
    case 7:
      result = lane_of(lane_sum(u));
      break;
    default:
      break;
  }
  lane_store(result, out, g);
}
