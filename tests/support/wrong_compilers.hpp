#pragma once
/// Compilers that are wrong on purpose: what is put before the source of each program, and what is
/// added to its options. Macros stand for what a compiler or its library of built-in functions
/// would do wrongly.

#include <array>
#include <string_view>

namespace qjulia::test {

struct WrongCompiler {
  std::string_view name, prelude, option{};
};

/// Before every prelude. QJ_EACH(F) is F(n) for scalars (an empty n) and all vectors. Built-in
/// functions may be macros themselves, so that a wrong one is a function that calls the right one,
/// before its name is taken. A program's own #line gives its lines their numbers.
inline constexpr std::string_view kOverloads =
    "#define QJ_EACH(F) F() F(2) F(3) F(4) F(8) F(16)\n"
    "#define QJ_WRONG static inline __attribute__((overloadable, unused))\n"
    "#ifdef cl_khr_fp64\n"
    "#pragma OPENCL EXTENSION cl_khr_fp64 : enable\n"
    "#endif\n";

inline constexpr std::array kWrongCompilers{
    WrongCompiler{"fmax-fmin", R"(
#define QJ_T(T) \
  QJ_WRONG T qj_max(T a, T b) { return fmin(a, b); } \
  QJ_WRONG T qj_min(T a, T b) { return fmax(a, b); }
#define QJ_F(n) QJ_T(float##n) QJ_T(double##n)
QJ_EACH(QJ_F)
#undef fmax
#undef fmin
#define fmax qj_max
#define fmin qj_min
)"},
    WrongCompiler{"volatile", "#define volatile\n"},
    WrongCompiler{"denormals", "", " -cl-denorms-are-zero"},
    WrongCompiler{"fma", R"(
#define QJ_T(T) QJ_WRONG T qj_fma(T a, T b, T c) { volatile T p = a * b; return p + c; }
#define QJ_F(n) QJ_T(float##n) QJ_T(double##n)
QJ_EACH(QJ_F)
#undef fma
#define fma qj_fma
)"},
    WrongCompiler{"convert", R"(
#define QJ_F(n) \
  QJ_WRONG int##n qj_int##n(float##n x) { return convert_int##n##_rte(x); } \
  QJ_WRONG long##n qj_long##n(double##n x) { return convert_long##n##_rte(x); }
QJ_EACH(QJ_F)
#undef convert_int
#undef convert_int3
#undef convert_int8
#undef convert_int16
#undef convert_long
#undef convert_long3
#undef convert_long8
#undef convert_long16
#define convert_int qj_int
#define convert_int3 qj_int3
#define convert_int8 qj_int8
#define convert_int16 qj_int16
#define convert_long qj_long
#define convert_long3 qj_long3
#define convert_long8 qj_long8
#define convert_long16 qj_long16
)"},
    WrongCompiler{"native-rsqrt", R"(
#define QJ_F(n) \
  QJ_WRONG float##n qj_rsqrt(float##n x) { return rsqrt(x) * 1.000244140625f; } \
  QJ_WRONG double##n qj_rsqrt(double##n x) { return rsqrt(x) * 1.000244140625; }
QJ_EACH(QJ_F)
#undef rsqrt
#define rsqrt qj_rsqrt
)"},
    WrongCompiler{"shuffle", R"(
#define QJ_T(T, space) \
  QJ_WRONG T##8 qj_load8(size_t i, const space T* p) { return vload8(i, p).s76543210; } \
  QJ_WRONG T##16 qj_load16(size_t i, const space T* p) { return vload16(i, p).sfedcba9876543210; }
#define QJ_S(T) QJ_T(T, global) QJ_T(T, local) QJ_T(T, constant) QJ_T(T, private)
QJ_S(float) QJ_S(double)
#undef vload
#undef vload8
#undef vload16
#define vload8 qj_load8
#define vload16 qj_load16
)"},
    WrongCompiler{"select", R"(
#define QJ_T(T, M) QJ_WRONG T qj_select(T a, T b, M mask) { return select(b, a, mask); }
#define QJ_F(n) \
  QJ_T(float##n, int##n) QJ_T(double##n, long##n) QJ_T(int##n, int##n) QJ_T(long##n, long##n)
QJ_EACH(QJ_F)
#undef select
#define select qj_select
)"},
    WrongCompiler{"last-group", R"(
QJ_WRONG size_t qj_id(uint d) {
  size_t id = get_global_id(d);
  return id > 0 && get_num_groups(d) > 1 && get_group_id(d) + 1 == get_num_groups(d) ? id - 1 : id;
}
#undef get_global_id
#define get_global_id qj_id
)"},
    WrongCompiler{"barrier", "#undef barrier\n#define barrier(fence)\n"},
    WrongCompiler{"atan-sign", R"(
#define QJ_T(T) QJ_WRONG T qj_atan(T x) { return -atan(x); }
#define QJ_F(n) QJ_T(float##n) QJ_T(double##n)
QJ_EACH(QJ_F)
#undef atan
#define atan qj_atan
)"},
    WrongCompiler{"fast-math", "", " -cl-fast-relaxed-math"},
    WrongCompiler{"nan", R"(
#define QJ_T(T, M) \
  QJ_WRONG M qj_isless(T a, T b) { return !isgreaterequal(a, b); } \
  QJ_WRONG M qj_isgreater(T a, T b) { return !islessequal(a, b); }
#define QJ_F(n) QJ_T(float##n, int##n) QJ_T(double##n, long##n)
QJ_EACH(QJ_F)
#undef isless
#undef isgreater
#define isless qj_isless
#define isgreater qj_isgreater
)"},
    WrongCompiler{"any", R"(
#define QJ_T(M) \
  QJ_WRONG int qj_any(M mask) { return mask.s0 < 0; } \
  QJ_WRONG int qj_all(M mask) { return mask.s0 < 0; }
#define QJ_F(n) QJ_T(int##n) QJ_T(long##n)
QJ_F(2) QJ_F(3) QJ_F(4) QJ_F(8) QJ_F(16)
#undef any
#undef all
#define any qj_any
#define all qj_all
)"},
    WrongCompiler{"double-sqrt", R"(
#define QJ_F(n) \
  QJ_WRONG float##n qj_sqrt(float##n x) { return sqrt(x); } \
  QJ_WRONG double##n qj_sqrt(double##n x) { return convert_double##n(sqrt(convert_float##n(x))); }
QJ_EACH(QJ_F)
#undef sqrt
#define sqrt qj_sqrt
)"},
    WrongCompiler{"floor", R"(
#define QJ_T(T) QJ_WRONG T qj_floor(T x) { return rint(x); }
#define QJ_F(n) QJ_T(float##n) QJ_T(double##n)
QJ_EACH(QJ_F)
#undef floor
#define floor qj_floor
)"},
};

}  // namespace qjulia::test
