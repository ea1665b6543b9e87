// What the map is in its file, but for its factors.
uniform float map_log_scale;   // S
uniform float map_file_level;  // L
uniform float map_own_detail;
uniform float map_inradius;  // of the shape, map units
uniform float factors_follow_detail;  // 1 where detail is in the factors' exponents, else 0
// Knobs, as their controls stand.
uniform float knob_detail, knob_drift, knob_scale;
uniform float map_slice;      // W of the points that 3-D coordinates stand for
uniform vec4 map_phase;       // p
uniform float map_steepness;  // k
// What the host has measured for these knobs: tools/explore/scene_table.hpp.
uniform float map_surface_level;  // L, calibrated
uniform float map_log_inner;      // ln r_in
uniform float map_log_outer;      // ln r_out
uniform float map_log_escape;     // ln of the escape radius

// F is so many times as steep as the file's, and so are the versor's exponents.
#define MAP_SHARPNESS (map_own_detail / knob_detail)
#define VERSOR_SHARPNESS mix(1.0, MAP_SHARPNESS, factors_follow_detail)
