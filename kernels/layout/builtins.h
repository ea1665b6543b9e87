#pragma once
// Built-in functions by their numbers in kernels/builtins.cl.

#define QJ_BUILTIN_FMAX 0
#define QJ_BUILTIN_FMIN 1
#define QJ_BUILTIN_FMA 2
#define QJ_BUILTIN_SQRT 3
#define QJ_BUILTIN_RSQRT 4
#define QJ_BUILTIN_ATAN 5
#define QJ_BUILTIN_FLOOR 6
#define QJ_BUILTIN_CONVERT 7
#define QJ_BUILTIN_SELECT 8
#define QJ_BUILTIN_ISLESS 9
#define QJ_BUILTIN_ISGREATER 10
#define QJ_BUILTIN_IS_NUMBER 11
#define QJ_BUILTIN_ANY 12
#define QJ_BUILTIN_ALL 13
#define QJ_BUILTIN_HALF 14
#define QJ_BUILTIN_COUNT 15

// Work-items of a group of `exchanged` at most.
#define QJ_EXCHANGE_GROUP 64
