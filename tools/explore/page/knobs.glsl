// What knobs make of the file's map: with_knobs in host/map/knobs.cpp. Points are in the file's map
// coordinates, where the shape stays; drift moves the origin of iteration.

// F without steepness, of a point where the file's F_1 - L is `above`.
float map_raised(float above) { return MAP_SHARPNESS * above + map_surface_level - log(knob_scale); }

// The same, given the file's F_1.
float map_turned(float f) { return map_raised(f - map_file_level); }

vec4 map_origin() { return vec4(0, 0, -knob_drift * map_inradius, 0); }
