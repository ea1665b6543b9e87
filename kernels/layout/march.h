#pragma once
/* How march_depth goes along rays. Compiled by host and device. */

#include "layout/arguments.h"

QJ_ARGUMENTS(qj_march) {
  real radius;    /* of a ball about the origin that holds the set */
  real steepest;  /* greatest |grad F_1| about the band */
  real shortest;  /* the least step */
  real first;     /* the least first step after a hint */
  real tolerance; /* of the depths of hits */
  real margin;    /* the table's F is right to this where it ends iterates before `tabled` */
  int iterations; /* n */
  int stride;     /* reals in an array of rays */
  int count;      /* rays */
  int share;      /* rays of a work-item */
  int sided;      /* the first iterate at which the table may end an orbit */
  int tabled;     /* the first iterate that is looked up in the table of images */
  int finer;      /* finer places along each side of a cell that has them (loose_places.clh) */
};
