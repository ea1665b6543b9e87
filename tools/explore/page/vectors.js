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
