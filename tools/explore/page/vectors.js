// Vectors and matrices of three dimensions as arrays; a matrix is its three rows.

export const plus = (a, b, s = 1) => a.map((v, i) => v + s * b[i]);
export const times = (s, a) => a.map((v) => s * v);
export const inner = (a, b) => a.reduce((sum, v, i) => sum + v * b[i], 0);
export const length = (a) => Math.hypot(...a);
export const unit = (a) => times(1 / length(a), a);
export const across = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const apply = (m, v) => m.map((row) => inner(row, v));
export const transpose = (m) => m[0].map((_, i) => m.map((row) => row[i]));
export const multiply = (m, n) => m.map((row) => transpose(n).map((column) => inner(row, column)));
/** Along "x", "y" or "z". */
export const axisOf = (name) => [0, 1, 2].map((i) => Number("xyz"[i] === name));
export const identity = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];

/** The smallest box, [low, high], that holds two. */
export const boxAround = (a, b) => [a[0].map((v, i) => Math.min(v, b[0][i])), a[1].map((v, i) => Math.max(v, b[1][i]))];
/** All points as far from the centre as `half` says at most. */
export const boxAbout = (center, half) => [plus(center, half, -1), plus(center, half)];
/** The smallest box that holds a box's image by p -> to + m (p - from). */
export const imageOfBox = ([low, high], m, from, to) =>
  boxAbout(plus(to, apply(m, plus(times(0.5, plus(low, high)), from, -1))), apply(m.map((row) => row.map(Math.abs)), times(0.5, plus(high, low, -1))));

/** The matrix of a turn about an axis, in degrees (Rodrigues). */
export function turnAbout(axis, degrees) {
  const [x, y, z] = unit(axis), a = degrees * Math.PI / 180, c = Math.cos(a), s = Math.sin(a), d = 1 - c;
  return [[c + d * x * x, d * x * y - s * z, d * x * z + s * y],
          [d * x * y + s * z, c + d * y * y, d * y * z - s * x],
          [d * x * z - s * y, d * y * z + s * x, c + d * z * z]];
}
