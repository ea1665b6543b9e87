// A map whose detail is the same everywhere: kernels/unpainted.clh.
float paint_share(vec4 q) { return 1.0; }
float painted(float f, vec4 q) { return f; }
