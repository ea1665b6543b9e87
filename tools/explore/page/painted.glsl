// Painted detail: F is L + (F - L) / m instead, m the share that a place has. kernels/painted.clh.
#include spline.glsl
#define QJ_PAINT_MARGIN 1.5
uniform highp sampler3D paint;  // 1 - m
uniform float paint_step, paint_strength;  // 0: as without paint
uniform vec3 paint_origin, paint_cells;

// In cells, within the part of the grid that has cells on each side.
vec3 paint_place(vec4 q) {
  return clamp((q.xyz - paint_origin) / paint_step, vec3(QJ_PAINT_MARGIN), paint_cells - QJ_PAINT_MARGIN);
}

float paint_share(vec4 q) { return 1.0 - paint_strength * spline_at(paint, paint_place(q)); }

float painted(float f, vec4 q) { return map_surface_level + (f - map_surface_level) / paint_share(q); }

// Of a point whose F without paint is f, with this gradient.
vec4 painted_gradient(vec4 gradient, float f, vec4 q) {
  vec3 u = paint_place(q);
  vec4 found = paint_strength * spline_gradient_at(paint, u);
  vec3 slopes = mix(found.yzw / paint_step, vec3(0), equal(u, vec3(QJ_PAINT_MARGIN)));
  slopes = mix(slopes, vec3(0), equal(u, paint_cells - QJ_PAINT_MARGIN));
  float share = 1.0 - found.x;
  return gradient / share + vec4((f - map_surface_level) / (share * share) * slopes, 0);
}
