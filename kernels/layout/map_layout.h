#pragma once
/* How a map lies in a device buffer of reals: a header; then five arrays over the factors
   (exponent, centre X, Y, Z, W), each padded with neutral factors (exponent 0) to QJ_MAP_STRIDE;
   then what the kind of versor keeps besides factors, the portals (layout/portal_layout.h), the
   paint (layout/paint_layout.h), and what the modulus keeps. Compiled by host and device. */

#define QJ_MAP_LOG_SCALE 0  /* S */
#define QJ_MAP_SLICE 1      /* W of the points 3-D coordinates stand for */
#define QJ_MAP_PHASE 2      /* four reals: X, Y, Z, W of a unit quaternion */
#define QJ_MAP_LOG_ESCAPE 6 /* ln of the escape radius: iteration goes on below it */
#define QJ_MAP_LOG_INNER 7  /* ln r_in: an iterate below it never leaves; -1e30 where unknown */
#define QJ_MAP_LOG_OUTER 8  /* ln r_out: an iterate above it never returns; +1e30 where unknown */
#define QJ_MAP_SURFACE_LEVEL 9 /* L: inside means F_n < L */
#define QJ_MAP_MODULUS 10      /* where what the modulus keeps begins in this buffer */
#define QJ_MAP_VERSOR 11       /* the same of the versor */
#define QJ_MAP_STEEPER 12      /* k - 1: F - L is k times as large where it is positive */
#define QJ_MAP_PORTALS 13      /* where the portals begin */
#define QJ_MAP_PORTAL_COUNT 14 /* how many there are */
#define QJ_MAP_PAINT 15        /* where the paint begins */
#define QJ_MAP_HEADER 16

#define QJ_MAP_EXPONENT 0
#define QJ_MAP_CENTER_X 1
#define QJ_MAP_CENTER_Y 2
#define QJ_MAP_CENTER_Z 3
#define QJ_MAP_CENTER_W 4
#define QJ_MAP_COMPONENTS 5

/* Factors per component array: the count rounded up to a multiple of the widest lane. */
#define QJ_MAP_STRIDE(factors) (((factors) + 15) / 16 * 16)
/* Reals before those of versor, portals and modulus. */
#define QJ_MAP_SIZE(factors) (QJ_MAP_HEADER + QJ_MAP_COMPONENTS * QJ_MAP_STRIDE(factors))

/* Most iterates any kernel runs. */
#define QJ_MOST_ITERATIONS 16
