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
#define QJ_LIGHT_SOFTNESS 18  /* tangent of its angular radius; 0 for those of the sky */
#define QJ_LIGHT_TEXEL 19     /* width of a texel */
#define QJ_LIGHT_MAP_SIZE 20  /* texels a side */
#define QJ_LIGHT_MAP_FIRST 21 /* index of its first texel in the atlas of all maps */
#define QJ_LIGHT_BOUNCE                                                    \
  22 /* of a lamp: index of the first of the texels that send its light on \
      */
#define QJ_LIGHT_SIZE 23

/* What a lamp's map sees of the shape, as lights: squares of texels, the first of half the map's
   side, each next one half as fine, sides rounded up. */
#define QJ_BOUNCE_LAST 8   /* the last has this many or fewer a side */
#define QJ_BOUNCE_DEPTH 0  /* along the map's rays; QJ_NO_HIT where nothing is */
#define QJ_BOUNCE_NORMAL 1 /* mean over the texel, with 0 where nothing is */
#define QJ_BOUNCE_ALBEDO 4
#define QJ_BOUNCE_SIZE 7

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
/* What is behind the shape: one of the backdrops below, a plain one's color, and the light on a
   studio's, relative to that of the studio's rig. */
#define QJ_SCENE_BACKDROP 18
#define QJ_SCENE_COLOR 19
#define QJ_SCENE_WALL_LIGHT 22
/* What the sky overhead, the sky at the horizon and the floor send. */
#define QJ_SCENE_ZENITH 25
#define QJ_SCENE_HORIZON 28
#define QJ_SCENE_FLOOR 31
/* What the shape is made of (qjulia/picture/matter.hpp). */
#define QJ_SCENE_ROUGHNESS 34
#define QJ_SCENE_METAL 35
#define QJ_SCENE_COAT 36
#define QJ_SCENE_SHEEN 37
#define QJ_SCENE_WAX 38
#define QJ_SCENE_GLOW 39
#define QJ_SCENE_GLOW_FROM 40
#define QJ_SCENE_FOG 41   /* for each radius of the shape, the logarithm of what is left */
#define QJ_SCENE_TONE 42  /* one of the curves below */
#define QJ_SCENE_CLAY 43  /* albedo where samples have no traits */
#define QJ_SCENE_STOPS 46 /* number of the colors that traits 0 ... 1 go through */
#define QJ_SCENE_STOP 47  /* the first of them */
#define QJ_MOST_STOPS 8
/* What is around the shape in place of sky and floor: the size of its first two maps, width 0 for
   none, and two of its axes; the third is up. */
#define QJ_SCENE_AROUND_WIDTH (QJ_SCENE_STOP + 3 * QJ_MOST_STOPS)
#define QJ_SCENE_AROUND_HEIGHT (QJ_SCENE_AROUND_WIDTH + 1)
#define QJ_SCENE_AROUND_RIGHT (QJ_SCENE_AROUND_WIDTH + 2)
#define QJ_SCENE_AROUND_BACK (QJ_SCENE_AROUND_WIDTH + 5)
#define QJ_SCENE_BOUNCE (QJ_SCENE_AROUND_WIDTH + 8) /* strength; 0: there are no such texels */
#define QJ_SCENE_GLOW_FULL (QJ_SCENE_BOUNCE + 1)
#define QJ_SCENE_SIZE (QJ_SCENE_GLOW_FULL + 1)

/* Radiance of the surroundings, three reals a texel: what is seen; the same without the sun; then
   maps of the size below, blurred as surfaces of roughness 1 / levels, 2 / levels ... 1 reflect it,
   and irradiance by pi. Texels of all maps: picture/environment.hpp. */
#define QJ_ENVIRONMENT_WIDTH 128
#define QJ_ENVIRONMENT_HEIGHT 64
#define QJ_ENVIRONMENT_LEVELS 8

#define QJ_TONE_NEUTRAL 0
#define QJ_TONE_AGX 1
#define QJ_TONE_ACES 2
#define QJ_TONE_NONE 3

/* The share of even light that GGX reflects, a F0 + b: pairs (a, b) at side x side values, the
   cosine to the viewer, 0 ... 1, fastest, then roughness, 0 ... 1. */
#define QJ_REFLECTANCE_SIDE 32

#define QJ_BACKDROP_STUDIO 0
#define QJ_BACKDROP_PLAIN 1
#define QJ_BACKDROP_NONE 2 /* pixels are transparent, but for shadows */
#define QJ_BACKDROP_AROUND 3

/* Height of a ground that nothing falls on. */
#define QJ_NO_GROUND 1e30f

/* A point that light falls on, and the light that reaches it. */
#define QJ_RECEIVER_POINT 0
#define QJ_RECEIVER_NORMAL 3 /* unit; 0: it receives nothing */
#define QJ_RECEIVER_SIZE 6
#define QJ_RECEIVED_SKY 0      /* irradiance from the sky; none on the ground */
#define QJ_RECEIVED_OPEN_SKY 3 /* the same with nothing in the way */
#define QJ_RECEIVED_SIZE 6
/* What of a lamp arrives at a receiver. */
#define QJ_LAMP_SEEN 0    /* share that comes straight */
#define QJ_LAMP_THROUGH 1 /* share that comes through the shape */
#define QJ_LAMP_SIZE 2

/* A pixel before it is developed. */
#define QJ_PIXEL_RADIANCE 0 /* mean over what it shows of the shape, times `shown` */
#define QJ_PIXEL_SHOWN 3    /* share of the pixel that shows the shape, less what fog hides */
#define QJ_PIXEL_GROUND                                                 \
  4 /* the rest, times how much darker shadows make what is behind, and \
       times radiance where that is the surroundings */
#define QJ_PIXEL_SIZE 7

/* What a pixel's radiance is made of, three reals each, means over the pixel, and the set's albedo;
   those of the lamps follow. */
#define QJ_PART_ALBEDO 0
#define QJ_PART_SKY 3
#define QJ_PART_BOUNCE 6
#define QJ_PART_GLOW 9
#define QJ_PART_LAMPS 12

/* A strip of a picture: `rows` rows of pixels from first_row on, of a view whose pixels are
   samples, samples x samples a pixel. Depths and normals begin `halo` rows of samples before it. */
QJ_ARGUMENTS(qj_strip_arguments) {
  int columns; /* pixels */
  int rows_in_all;
  int first_row;
  int rows;
  int samples;
  int halo;
  int lamps;
  int has_traits;
  int has_near_shadow;
  int has_parts; /* layers are asked for */
};

/* Scalars of the kernels that light receivers. */
QJ_ARGUMENTS(qj_light_arguments) {
  real narrowest; /* penumbra of a lamp on samples, texels */
  real thin;      /* length in which light in the shape falls to 1/e; 0: none goes through */
  int receivers;
  int ground;  /* receivers from this one on are points of the ground */
  int wide;    /* samples in a row */
  int samples; /* a pixel has samples x samples */
  int lamps;   /* lights before the sky's */
  int lights;
  int lamp; /* number of the one at hand */
};

/* Depth where a ray meets nothing. */
#define QJ_NO_HIT (-1)

/* What an orbit's trait tells (orbit_trait.cl). */
#define QJ_TRAIT_ITERATIONS 0
#define QJ_TRAIT_TRAP 1
#define QJ_TRAIT_GROOVE 2
#define QJ_TRAIT_FACTOR 3
