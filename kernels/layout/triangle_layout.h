#pragma once
/* How the inverse of a triangle and its products are divided over work-items. Compiled by host and
   device. */

/* Rows that a work-item computes of the inverse: divides QJ_CHOLESKY_BLOCK. */
#define QJ_INVERSE_ROWS 8
/* Work-items that a row or column of a product is divided over. */
#define QJ_TRIANGLE_PARTS 32
