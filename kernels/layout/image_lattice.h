#pragma once
/* Lattices of images as kernels see them. Compiled by host and device.

   A lattice has levels, the one that composes most iterates first. A level is described by
   QJ_LEVEL_SIZE reals: its nodes, a regular grid as layout/picture_layout.h says, in coordinates
   along three axes; and what follows. */

#include "layout/picture_layout.h"

#define QJ_LEVEL_AXES QJ_GRID_SIZE            /* three unit vectors at right angles */
#define QJ_LEVEL_ITERATES (QJ_GRID_SIZE + 9)  /* how many iterates its images are composed of */
#define QJ_LEVEL_PAGES (QJ_GRID_SIZE + 10)    /* pages of the levels before it */
#define QJ_LEVEL_FOLLOWED (QJ_GRID_SIZE + 11) /* 1 if another level follows, else 0 */
#define QJ_LEVEL_SIZE (QJ_GRID_SIZE + 12)

/* Where nodes are stored: a row consists of whole groups of nodes that follow each other along the
   first axis, and a group with a node that is needed has room for all of its nodes. A group's entry
   has a bit for each of its nodes, set where that node is stored, and above these bits the place of
   its first node.

   Most groups have no such node. So entries stand in pages, of groups with numbers that follow each
   other, and pages without a node are all the same one. First the numbers of all pages' first
   entries are listed, then pages follow. */

#define QJ_LATTICE_GROUP 4 /* nodes; divides a row's nodes */
#define QJ_LATTICE_PAGE 16 /* groups */
#define QJ_LATTICE_PAGE_NODES (QJ_LATTICE_GROUP * QJ_LATTICE_PAGE)
