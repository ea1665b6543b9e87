#include distance.glsl

// The first point of the set along a ray; negative where there is none.
float first_hit(vec3 eye, vec3 ray, float end) {
  float t = 0.0, outside = 0.0;
  for (int i = min(0, iFrame); i < 400 && t < end; ++i) {
    float d = formula_distance(eye + t * ray);
    if (d >= 0.0) {
      outside = t, t += d;
      continue;
    }
    for (int j = min(0, iFrame); j < 5; ++j) {
      float middle = 0.5 * (outside + t);
      if (formula_distance(eye + middle * ray) < 0.0) t = middle;
      else outside = middle;
    }
    return outside;
  }
  return -1.0;
}

// The share of light that comes to p from a direction, by what of the set is within reach.
float open_share(vec3 p, vec3 direction, float reach) {
  float open = 1.0;
  for (int i = 1 + min(0, iFrame); i <= 4; ++i) {
    float way = reach * float(i * i) / 16.0;
    if (formula_distance(p + way * direction) < 0.0) open *= 0.55;
  }
  return open;
}

void mainImage(out vec4 fragColor, in vec2 fragCoord) {
  vec2 turn = vec2(radians(30.0) + 0.2 * iTime, radians(15.0));
  if (iMouse.x > 0.0) turn = vec2(6.2832, 3.0) * (iMouse.xy / iResolution.xy - vec2(0.5, 0.4));
  float level = cos(turn.y);
  vec3 back = vec3(level * sin(turn.x), sin(turn.y), level * cos(turn.x));
  vec3 right = vec3(cos(turn.x), 0, -sin(turn.x)), up = cross(back, right);
  vec2 at = (2.0 * fragCoord - iResolution.xy) / iResolution.y;
  vec3 eye = 5.6 * back, ray = normalize(0.27 * (at.x * right + at.y * up) - back);

  vec3 color = vec3(0.62, 0.64, 0.67) * (1.0 - 0.12 * dot(at, at));
  float t = first_hit(eye, ray, 9.0);
  if (t >= 0.0) {
    float reach = max(4.0 * FinestStep, t * 0.8 / iResolution.y);  // 1.5 pixels
    vec3 p = eye + t * ray, n = formula_normal(p, reach);
    vec3 light = normalize(0.8 * back + vec3(0, 0.8, 0) - 0.9 * right);
    float key = max(dot(n, light), 0.0) * open_share(p + reach * n, light, 0.4);
    float sky = (0.6 + 0.4 * n.y) * open_share(p + reach * n, n, 0.25);
    color = vec3(0.66, 0.45, 0.32) * (1.1 * key + 0.4 * sky);
  }
  fragColor = vec4(pow(color, vec3(1.0 / 2.2)), 1);
}
