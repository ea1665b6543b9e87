#pragma once
/* How a bounding volume hierarchy of triangles lies in device buffers. Compiled by host and device.
   Node 0 is the root; each node has QJ_NODE_REALS reals and QJ_NODE_INTS integers. A leaf owns the
   triangles [first, first + count); an inner node has count 0 and the children first and
   first + 1. */

#define QJ_NODE_LOW 0      /* box: least x, y, z */
#define QJ_NODE_HIGH 3     /* box: greatest x, y, z */
#define QJ_NODE_CENTROID 6 /* area-weighted centroid of the node's triangles */
#define QJ_NODE_NORMAL 9   /* sum of area * unit normal: the strength of the dipole */
#define QJ_NODE_FAR 12     /* squared distance from the centroid beyond which the dipole will do */
#define QJ_NODE_REALS 16

#define QJ_NODE_FIRST 0
#define QJ_NODE_COUNT 1
#define QJ_NODE_PARENT 2 /* the root's is the root */
#define QJ_NODE_NEXT 3   /* the node after this one's subtree, left children first; or none */
#define QJ_NODE_INTS 4
#define QJ_NODE_NONE (-1)
/* The other child of the same parent: children have the numbers 1 and 2, 3 and 4, ... */
#define QJ_NODE_SIBLING(node) ((((node)-1) ^ 1) + 1)

#define QJ_TRIANGLE_A 0      /* corner a */
#define QJ_TRIANGLE_AB 3     /* b - a */
#define QJ_TRIANGLE_AC 6     /* c - a */
#define QJ_TRIANGLE_NORMAL 9 /* unit normal; 0 where the triangle has no area */
#define QJ_TRIANGLE_AB2 12   /* 1 / |b - a|^2, 0 for an edge without length */
#define QJ_TRIANGLE_AC2 13   /* 1 / |c - a|^2 */
#define QJ_TRIANGLE_BC2 14   /* 1 / |c - b|^2 */
#define QJ_TRIANGLE_REALS 16

/* Levels of a tree are fewer: a traversal keeps a bit for each. */
#define QJ_BVH_LEVELS 64
