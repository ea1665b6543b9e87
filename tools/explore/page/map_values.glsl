// What the map is, but for its factors.
uniform float map_log_scale;      // S
uniform float map_slice;          // W of the points that 3-D coordinates stand for
uniform vec4 map_phase;           // p
uniform float map_log_escape;     // ln of the escape radius
uniform float map_log_inner;      // ln r_in
uniform float map_log_outer;      // ln r_out
uniform float map_surface_level;  // L
uniform float map_steeper;        // k - 1
