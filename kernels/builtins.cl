// What kernels expect of a compiler and of its built-in functions, one at a time, so that `qjulia
// doctor` finds a wrong one where whole kernels hide it in their tolerances.

#include "lanes.clh"
#include "layout/builtins.h"

#if QJ_WIDTH == 1
#define to_ilane(v) QJ_JOIN(convert_, QJ_INT)(v)
#else
#define to_ilane(v) QJ_JOIN(QJ_JOIN(convert_, QJ_INT), QJ_WIDTH)(v)
#endif

// 1 where the mask is set, else 0.
static inline lane lane_flag(ilane mask) { return lane_where(mask, lane_of(1), lane_of(0)); }

// out[i] = the function numbered `function` of x[i] and y[i]; any and all take the lanes of a
// work-item together. Arrays of groups * QJ_WIDTH reals; one work-item per QJ_WIDTH of them.
kernel void builtins(global const real* x, global const real* y, int groups, int function,
                     global real* out) {
  int g = (int)get_global_id(0);
  if (g >= groups) return;
  lane u = lane_load(x, g);
  lane v = lane_load(y, g);
  lane result = u;
  switch (function) {
    case QJ_BUILTIN_FMAX:
      result = fmax(u, v);
      break;
    case QJ_BUILTIN_FMIN:
      result = fmin(u, v);
      break;
    case QJ_BUILTIN_FMA: {
      // What rounding took from a product: nothing is left of it where fma rounds twice.
      lane product = u * v;
      result = fma(u, v, -product);
      break;
    }
    case QJ_BUILTIN_SQRT:
      result = sqrt(u);
      break;
    case QJ_BUILTIN_RSQRT:
      result = rsqrt(u);
      break;
    case QJ_BUILTIN_ATAN:
      result = atan(u);
      break;
    case QJ_BUILTIN_FLOOR:
      result = floor(v);
      break;
    case QJ_BUILTIN_CONVERT:
      result = to_lane(to_ilane(v));
      break;
    case QJ_BUILTIN_SELECT:
      result = lane_where(isless(u, v), u, v);
      break;
    case QJ_BUILTIN_ISLESS:
      result = lane_flag(isless(u, v));
      break;
    case QJ_BUILTIN_ISGREATER:
      result = lane_flag(isgreater(u, v));
      break;
    case QJ_BUILTIN_IS_NUMBER:
      result = lane_flag(v == v);  // false for NaN alone
      break;
    case QJ_BUILTIN_ANY:
      result = lane_of(lane_any(isless(u, v)) ? 1 : 0);
      break;
    case QJ_BUILTIN_ALL:
      result = lane_of(lane_all(isless(u, v)) ? 1 : 0);
      break;
    case QJ_BUILTIN_HALF:
      result = u * (real)0.5;
      break;
    default:
      break;
  }
  lane_store(result, out, g);
}

// Each work-item hands its number in the whole range on to the next one of its group, by local
// memory: out[i] is the number of the item before i, or of the group's last.
kernel void exchanged(global int* out) {
  local int numbers[QJ_EXCHANGE_GROUP];
  int l = (int)get_local_id(0), size = (int)get_local_size(0);
  int i = (int)get_global_id(0);
  numbers[(l + 1) % size] = i;
  barrier(CLK_LOCAL_MEM_FENCE);
  out[i] = numbers[l];
}
