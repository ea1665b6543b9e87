// cos A + sin A (i cos B + j sin B cos C + k sin B sin C) of angles in degrees.
vec4 phase_of(vec3 degrees) {
  vec3 s = sin(radians(degrees)), c = cos(radians(degrees));
  return vec4(c.x, s.x * c.y, s.x * s.y * c.z, s.x * s.y * s.z);
}

#include map.glsl

// A position of the picture in map coordinates. In the picture the shape's box is centred, its
// longest side is 2 and Y points up.
vec4 to_map(vec3 p) { return vec4(frame_scale * (frame_turn * p) + frame_center, map_slice); }

// Never more than the distance from p to the set where p is outside, and never less than
// FinestStep; negative where p is inside.
//
// Where an orbit escapes, F_1, the F of its first iterate, falls towards the band of undecided
// points no faster than `steepest` a unit: its excess over `far`, divided by `steepest`, is a safe
// step. Poles outside the band are steeper, so no step leads past the nearest centre. An orbit that
// escapes later gives a safe step too, because an iterate stretches a short way by no more than
// e^F steepest / ln 2.
float formula_distance(vec3 p) {
  vec4 q = to_map(p);
  float beyond = length(q.xyz) - ball_radius;
  if (beyond > 0.25 * ball_radius) return beyond / frame_scale;
  float far = Iterations == 1 ? map_surface_level : far_level;
  float slope = steepest * Steepness, slow = QJ_LN2 / slope, most, per_way = 1.0;
  float f = map_steep(kind_modulus_near(q, most));
  for (int i = 1; i < Iterations && f < far && f > map_log_inner; ++i) {
    q = map_image(q, f);
    most = min(most, per_way * slow);
    per_way = min(per_way * slow * lane_exp(-f), 1e15);
    f = map_modulus(q);
  }
  if (f < map_surface_level) return -FinestStep;
  return max(min(most, per_way * (f - far) / slope) / frame_scale, FinestStep);
}

// Which way the set ends about p: from where points near it are inside. It is coarse by design,
// because the set's surface has no normal.
vec3 formula_normal(vec3 p, float reach) {
  vec3 sum = vec3(0);
  for (int i = 0; i < NORMAL_POINTS; ++i) {
    // Even directions over the sphere, by the golden angle; distances alternate.
    float z = 1.0 - (2.0 * float(i) + 1.0) / float(NORMAL_POINTS), a = 2.39996 * float(i);
    vec3 d = vec3(sqrt(1.0 - z * z) * vec2(cos(a), sin(a)), z);
    float way = reach * (float(i % 3) + 1.0) / 3.0;
    sum += formula_distance(p + way * d) < 0.0 ? -d : d;
  }
  return normalize(sum + 1e-6);
}
