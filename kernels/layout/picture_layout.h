#pragma once
/* Views and lights as kernels see them: arrays of reals. Compiled by host and device. */

#include "layout/arguments.h"

/* A view. The ray of pixel coordinates (x, y), pixel centres at halves, y downward, starts at
   eye + x eye_dx + y eye_dy and runs along dir + x dir_dx + y dir_dy, normalised. Depth is the
   length along it. A perspective view has eye_dx = eye_dy = 0, a parallel one
   dir_dx = dir_dy = 0. */
#define QJ_VIEW_EYE 0
#define QJ_VIEW_EYE_DX 3
#define QJ_VIEW_EYE_DY 6
#define QJ_VIEW_DIR 9
#define QJ_VIEW_DIR_DX 12
#define QJ_VIEW_DIR_DY 15
#define QJ_VIEW_SIZE 18

/* A regular grid: point (i, j, k) lies at origin + step (i, j, k); values have i fastest, then j.
   Rays go through the part of space seen, a box inside the grid. */
#define QJ_GRID_ORIGIN 0
#define QJ_GRID_STEP 3
#define QJ_GRID_POINTS 4 /* three counts */
#define QJ_GRID_SEEN_LOW 7
#define QJ_GRID_SEEN_HIGH 10
#define QJ_GRID_SIZE 13

/* A light: a direction with a square depth map seen along it. */
#define QJ_LIGHT_DIRECTION 0  /* towards the light, unit */
#define QJ_LIGHT_COLOR 3      /* irradiance of a surface that faces it */
#define QJ_LIGHT_U 6          /* column of p, in texels: dot(p, U.xyz) + U.w */
#define QJ_LIGHT_V 10         /* row of p, in texels */
#define QJ_LIGHT_DEPTH 14     /* depth of p along the map's rays */
#define QJ_LIGHT_SOFTNESS 18  /* tangent of its angular radius; the key light alone has one */
#define QJ_LIGHT_TEXEL 19     /* width of a texel */
#define QJ_LIGHT_MAP_SIZE 20  /* texels a side */
#define QJ_LIGHT_MAP_FIRST 21 /* index of its first texel in the atlas of all maps */
#define QJ_LIGHT_SIZE 22

/* The scene around the shape. */
#define QJ_SCENE_UP 0     /* unit */
#define QJ_SCENE_GROUND 3 /* height of the ground along up */
#define QJ_SCENE_CENTER 4 /* of the shape */
#define QJ_SCENE_RADIUS 7 /* of the shape */
/* The sky's light on the ground is known at side x side points; along two axes across `up` they lie
   at radius u / (1 - crowding |u|) from the middle, u = -1 ... 1 evenly. */
#define QJ_SCENE_RIGHT 8
#define QJ_SCENE_FRONT 11
#define QJ_SCENE_SIDE 14
#define QJ_SCENE_OPEN_SKY 15 /* irradiance of the ground with nothing in the way */
#define QJ_GROUND_CROWDING (5.0f / 6)
/* What is behind the shape: one of the backdrops below, and a plain one's color. */
#define QJ_SCENE_BACKDROP 18
#define QJ_SCENE_COLOR 19
#define QJ_SCENE_CLAY 22  /* albedo where samples have no traits */
#define QJ_SCENE_STOPS 25 /* number of the colors that traits 0 ... 1 go through */
#define QJ_SCENE_STOP 26  /* the first of them */
#define QJ_MOST_STOPS 8
#define QJ_SCENE_SIZE (QJ_SCENE_STOP + 3 * QJ_MOST_STOPS)

#define QJ_BACKDROP_STUDIO 0
#define QJ_BACKDROP_PLAIN 1
#define QJ_BACKDROP_NONE 2 /* pixels are transparent, but for shadows */

/* Height of a ground that nothing falls on. */
#define QJ_NO_GROUND 1e30f

/* A point that light falls on, and the light that reaches it. */
#define QJ_RECEIVER_POINT 0
#define QJ_RECEIVER_NORMAL 3 /* unit; 0: it receives nothing */
#define QJ_RECEIVER_SIZE 6
#define QJ_RECEIVED_SKY 0      /* irradiance from all but the key light; none on the ground */
#define QJ_RECEIVED_OPEN_SKY 3 /* the same with nothing in the way */
#define QJ_RECEIVED_KEY 6      /* share of the key light that arrives */
#define QJ_RECEIVED_SIZE 7

/* A strip of a picture: `rows` rows of pixels from first_row on, of a view whose pixels are
   samples, samples x samples a pixel. Depths and normals begin `halo` rows of samples before it. */
QJ_ARGUMENTS(qj_strip_arguments) {
  int columns; /* pixels */
  int rows_in_all;
  int first_row;
  int rows;
  int samples;
  int halo;
  int has_traits;
  int has_near_shadow;
};

/* Scalars of the kernels that light receivers. */
QJ_ARGUMENTS(qj_light_arguments) {
  real narrowest; /* penumbra of the key light on samples, texels */
  int receivers;
  int ground;  /* receivers from this one on are points of the ground */
  int wide;    /* samples in a row */
  int samples; /* a pixel has samples x samples */
  int lights;
  int key; /* number of the key light */
};

/* Depth where a ray meets nothing. */
#define QJ_NO_HIT (-1)

/* What an orbit's trait tells (orbit_trait.cl). */
#define QJ_TRAIT_ITERATIONS 0
#define QJ_TRAIT_TRAP 1
#define QJ_TRAIT_GROOVE 2
#define QJ_TRAIT_FACTOR 3
