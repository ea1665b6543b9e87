// Portals: kernels/portals.clh.
#define QJ_PORTAL_ITERATES 4
uniform vec4 portal_balls[PORTALS];         // centre, radius
uniform vec4 portal_destinations[PORTALS];  // where the centre leads, mask
uniform mat3 portal_matrices[PORTALS];      // scale times the rotation
uniform float portal_scales[PORTALS];
uniform int portal_count;

float portal_distance(vec4 q, int i) {
  vec4 ball = portal_balls[i];
  return length(vec4(q.xyz - ball.xyz, q.w)) - ball.w;
}

vec4 portal_similarity(vec4 q, int i) {
  return vec4(portal_matrices[i] * (q.xyz - portal_balls[i].xyz) + portal_destinations[i].xyz,
              portal_scales[i] * q.w);
}

// Whether q is inside after a few iterates of the map without portals.
bool plain_is_inside(vec4 q) {
  float above = min(map_log_escape, map_log_outer);
  float f = plain_modulus(q);
  for (int i = 1; i < QJ_PORTAL_ITERATES; ++i) {
    if (!(f < above && f > map_log_inner)) break;
    q = plain_image(q, f);
    f = plain_modulus(q);
  }
  return f < map_surface_level;
}

// Whether a portal takes q, and where it leads.
bool taken_by_portals(vec4 q, out vec4 image) {
  image = q;
  for (int i = 0; i < portal_count; ++i) {
    if (portal_distance(q, i) >= 0.0) continue;
    image = portal_similarity(q, i);
    float mask = portal_destinations[i].w;
    if (mask == 0.0) return true;
    return plain_is_inside(q) == (mask < 0.0);
  }
  return false;
}

float map_modulus(vec4 q) {
  vec4 image;
  return taken_by_portals(q, image) ? map_log_radius(image) : plain_modulus(q);
}

vec4 map_image(vec4 q, float f) {
  vec4 image;
  return taken_by_portals(q, image) ? image : plain_image(q, f);
}

// How far outside all portals q is.
float distance_to_portals(vec4 q) {
  float nearest = 1e15;
  for (int i = 0; i < portal_count; ++i) nearest = min(nearest, portal_distance(q, i));
  return nearest;
}

// How far the band {F_1 < far_level}, or the points from which portals lead into it, is at least,
// given what the first is without portals.
float map_safe_step(vec4 q, int iterations, float far_level, float steepest, float plain) {
  float safe = plain;
  for (int i = 0; i < portal_count; ++i) {
    if (portal_destinations[i].w == 0.0) safe = max(safe, -portal_distance(q, i));
  }
  for (int i = 0; i < portal_count; ++i) {
    float rim = portal_distance(q, i);
    if (rim >= safe) continue;
    vec4 p = portal_similarity(q, i);
    float beyond = length(p - map_origin()) - exp(far_level);
    if (iterations > 1) {
      beyond = min(plain_safe_step(p, far_level, steepest), distance_to_portals(p));
    }
    safe = min(safe, max(rim, beyond / portal_scales[i]));
  }
  return safe;
}
