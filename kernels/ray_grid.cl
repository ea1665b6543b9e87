// First hits of rays with {value < 0} of a grid: a set seen coarsely, for light that comes from
// everywhere. One work-item per ray, whatever the lane width.

#include "grid.clh"
#include "view.clh"

// Depths of `rows` rows of the view from `first_row` on. safe: distances that rays may go from each
// point (see safe_steps of ray_march.cl).
kernel void grid_depth(global const real* view, int columns, int first_row, int rows,
                       global const real* grid, global const real* safe, global const real* values,
                       global real* depth) {
  int column = (int)get_global_id(0), row = (int)get_global_id(1);
  if (column >= columns || row >= rows) return;
  real3 direction;
  real3 origin = view_point(view, (real)column + (real)0.5, (real)(row + first_row) + (real)0.5, 0,
                            &direction);
  real step = grid[QJ_GRID_STEP];
  // The part of the ray that is seen.
  real o[3] = {origin.x, origin.y, origin.z};
  real d[3] = {direction.x, direction.y, direction.z};
  real t = 0, end = (real)1e30f;
  for (int i = 0; i < 3; ++i) {
    real low = grid[QJ_GRID_SEEN_LOW + i], high = grid[QJ_GRID_SEEN_HIGH + i];
    real a = (low - o[i]) / d[i], b = (high - o[i]) / d[i];
    if (fabs(d[i]) < (real)1e-9f) {
      if (o[i] < low || o[i] > high) end = -1;
      continue;
    }
    t = fmax(t, fmin(a, b));
    end = fmin(end, fmax(a, b));
  }
  real found = QJ_NO_HIT, last = 1, before = t;
  while (t < end) {
    real3 p = origin + t * direction;
    real ahead = grid_value(grid, safe, p.x, p.y, p.z);
    if (ahead > step) {
      last = 1, before = t;
      t += ahead;
      continue;
    }
    real value = grid_value(grid, values, p.x, p.y, p.z);
    if (value < 0) {
      found = mix(before, t, last / (last - value));
      break;
    }
    last = value, before = t;
    t += (real)0.5 * step;
  }
  depth[row * columns + column] = found;
}
