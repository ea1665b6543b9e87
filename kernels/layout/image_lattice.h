#pragma once
/* Where a lattice of images stores its nodes. Compiled by host and device. A row consists of whole
   groups of nodes that follow each other along X, and a group with a node that is needed has room
   for all of its nodes. A group's entry has a bit for each of its nodes, set where that node is
   stored, and above these bits the place of its first node. */

#define QJ_LATTICE_GROUP 4 /* nodes; divides a row's nodes */
