#pragma once
/* What a noise versor keeps in a map's buffer. Compiled by host and device. */

#define QJ_NOISE_OCTAVES 0    /* number of them */
#define QJ_NOISE_SCALE 1      /* lattice cells a map unit, of the first octave */
#define QJ_NOISE_SEED 2       /* its low 16 bits, then its high ones */
#define QJ_NOISE_COMPONENTS 4 /* 3: vectors with W = 0; 4: quaternions */
#define QJ_NOISE_ORIGIN 5     /* three reals: where the lattice begins, map units */
#define QJ_NOISE_SIZE 8
