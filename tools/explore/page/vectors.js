// Vectors of three dimensions as arrays, for the camera and the pointer.

export const plus = (a, b, s = 1) => a.map((v, i) => v + s * b[i]);
export const times = (s, a) => a.map((v) => s * v);
export const inner = (a, b) => a.reduce((sum, v, i) => sum + v * b[i], 0);
export const across = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
/** Along "x", "y" or "z". */
export const axisOf = (name) => [0, 1, 2].map((i) => Number("xyz"[i] === name));

/** A unit quaternion by three angles, degrees. */
export function phaseOf([a, b, c]) {
  const [r, s, t] = [a, b, c].map((degrees) => degrees * Math.PI / 180);
  return [Math.cos(r), Math.sin(r) * Math.cos(s), Math.sin(r) * Math.sin(s) * Math.cos(t),
          Math.sin(r) * Math.sin(s) * Math.sin(t)];
}

/** Angles as `phaseOf` takes them. */
export const anglesOf = ([w, x, y, z]) =>
  [[Math.hypot(x, y, z), w], [Math.hypot(y, z), x], [z, y]].map(([a, b]) => Math.atan2(a, b) * 180 / Math.PI);

/** Between two phases by their angles, along the shortest turn; `way` from 0 to 1. */
export function turned(from, to, way) {
  const a = phaseOf(from), b = phaseOf(to), cosine = inner(a, b), sign = cosine < 0 ? -1 : 1;
  const angle = Math.acos(Math.min(1, sign * cosine)), isSmall = angle < 1e-6;
  const left = isSmall ? 1 - way : Math.sin((1 - way) * angle) / Math.sin(angle);
  const right = isSmall ? way : Math.sin(way * angle) / Math.sin(angle);
  return anglesOf(plus(times(left, a), b, sign * right));
}
