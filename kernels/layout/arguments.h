#pragma once
/* The scalars of a launch as one struct that host and device compile, passed by value. Its members
   are `real` and int, reals first. On the device `real` has the program's precision; on the host
   the struct is a template over it. */

#ifdef __cplusplus
#define QJ_ARGUMENTS(name) \
  template <class real>    \
  struct name
#else
#include "lanes.clh"

#define QJ_ARGUMENTS(name)  \
  typedef struct name name; \
  struct name
#endif
