// Rays of a view: kernels/view.clh. The ray of pixel (x, y), y upwards, runs along dir + x dir_dx +
// y dir_dy.
uniform vec3 eye, dir, dir_dx, dir_dy;

vec3 view_direction(vec2 pixel) { return normalize(dir + pixel.x * dir_dx + pixel.y * dir_dy); }
