// Painted detail: F is L + (F - L) / m instead, m the share that a place has. kernels/painted.clh.
#include spline.glsl
#define QJ_PAINT_MARGIN 1.5
uniform highp sampler3D paint;  // shares: m = (255 share + 1) / 256
uniform float paint_step;
uniform vec3 paint_origin, paint_cells;

// In cells, within the part of the grid that has cells on each side.
vec3 paint_place(vec4 q) {
  return clamp((q.xyz - paint_origin) / paint_step, vec3(QJ_PAINT_MARGIN), paint_cells - QJ_PAINT_MARGIN);
}

float paint_share(vec4 q) { return (255.0 * spline_at(paint, paint_place(q)) + 1.0) / 256.0; }

float painted(float f, vec4 q) { return map_surface_level + (f - map_surface_level) / paint_share(q); }

