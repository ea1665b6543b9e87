#pragma once
/* A portal in a map's buffer. Lengths are map units. Compiled by host and device. */

#define QJ_PORTAL_CENTER 0      /* three reals; its W is 0 */
#define QJ_PORTAL_RADIUS 3      /* of the ball in four dimensions */
#define QJ_PORTAL_SCALE 4       /* what W is multiplied by */
#define QJ_PORTAL_MASK 5        /* 1: points that are outside without portals; -1: inside; 0: all */
#define QJ_PORTAL_DESTINATION 6 /* three reals: where the centre leads */
#define QJ_PORTAL_MATRIX 9      /* nine reals by rows: scale times the rotation */
#define QJ_PORTAL_SIZE 18

/* Iterates that tell which side a point is on without portals. */
#define QJ_PORTAL_ITERATES 4
