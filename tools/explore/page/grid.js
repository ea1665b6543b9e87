// What does not change while a slice stays: F_1 - L on a grid about the set, in the file's own
// coordinates and at its own detail, and how steep it is. host/picture/band_grid.cpp.
import { map, shapeBox } from "./map.js";
import { asked, evaluate, uniformsOf } from "./field.js";
import { bind, drawAll, drawn, drawTo, gl, program, texture, uploadFactors, use } from "./gl.js";
import { boxAbout, boxAround, length, plus, times } from "./vectors.js";

const layers = program("grid.glsl");

/** A box about {F_1 - L < most} in the slice, by a coarse grid; null where there is none. */
function boxOfBand(uniforms, most) {
  const [low, high] = shapeBox(), side = Math.max(...plus(high, low, -1)), cells = 32;
  const from = low.map((v) => v - 0.35 * side), to = high.map((v) => v + 0.35 * side);
  const step = Math.max(...plus(to, from, -1)) / cells;
  const n = to.map((v, i) => Math.ceil((v - from[i]) / step) + 1);
  const points = new Float32Array(4 * n[0] * n[1] * n[2]);
  for (let i = 0; i < points.length / 4; ++i) {
    const at = [i % n[0], Math.floor(i / n[0]) % n[1], Math.floor(i / n[0] / n[1])];
    points.set([...at.map((k, axis) => from[axis] + k * step), uniforms.map_slice], 4 * i);
  }
  const found = evaluate(uniforms, points, asked.field, { iterations: 0 });
  let box = null;
  for (let i = 0; i < points.length / 4; ++i) {
    if (!(found[4 * i + 1] - uniforms.map_surface_level < most)) continue;
    const p = [...points.subarray(4 * i, 4 * i + 3)];
    box = boxAround(box ?? [p, p], [p, p]);
  }
  return box && [box[0].map((v) => v - 1.2 * step), box[1].map((v) => v + 1.2 * step)];
}

const levels = [-0.5, 0, 0.25, 0.5, 1, 1.5, 2, 3, 4, 6, 8];

/** Nearly the greatest slope of F_1 at each of the levels: points led there by Newton's steps. */
function slopesOf(uniforms, [low, high]) {
  const each = 256, points = new Float32Array(4 * each * levels.length);
  for (let i = 0; i < each * levels.length; ++i) {
    // An additive recurrence: even over the box.
    const u = [0.8191725134, 0.6710436067, 0.5497004779].map((a) => (0.5 + (i + 1) * a) % 1);
    points.set([...u.map((v, k) => low[k] + v * (high[k] - low[k])), uniforms.map_slice], 4 * i);
  }
  let slopes;
  for (let step = 0; step < 6; ++step) {
    const found = evaluate(uniforms, points, asked.gradient);
    slopes = levels.map(() => []);
    for (let i = 0; i < each * levels.length; ++i) {
      const k = Math.floor(i / each), g = [...found.subarray(4 * i, 4 * i + 3)], size = length(g);
      const above = found[4 * i + 3] - uniforms.map_surface_level - levels[k];
      if (Math.abs(above) < 0.4 && Number.isFinite(size)) slopes[k].push(size);
      if (!(size > 0)) continue;
      const move = times(-Math.min(Math.max(above / size, -0.5), 0.5) / size, g);
      for (let axis = 0; axis < 3; ++axis) points[4 * i + axis] += move[axis];
    }
  }
  return slopes.map((some) => some.sort((a, b) => a - b)[Math.floor(0.95 * some.length)]);
}

/** Slope at a level of F_1 - L. */
export function slopeAt(grid, level) {
  const known = levels.map((l, i) => [l, grid.slopes[i]]).filter(([, slope]) => slope !== undefined);
  if (known.length === 0) return 10;
  const after = known.findIndex(([l]) => l >= level);
  if (after === 0) return known[0][1];
  if (after < 0) return known.at(-1)[1];
  const [a, b] = [known[after - 1], known[after]], way = (level - a[0]) / (b[0] - a[0]);
  return a[1] + way * (b[1] - a[1]);
}

/** @param most the grid's box holds the points where F_1 - L is less. */
export async function makeGrid(slice, most, cells) {
  uploadFactors(map.factors);
  const uniforms = { ...uniformsOf(map), map_slice: slice, map_steeper: 0, paint_strength: 0 };
  let box = boxOfBand(uniforms, most);
  for (const { center, radius } of map.portals ?? []) {
    const ball = boxAbout(center, [radius, radius, radius]);
    box = boxAround(box ?? ball, ball);
  }
  const isEmpty = !box;
  const [low, high] = box ?? shapeBox();
  const size = plus(high, low, -1), step = Math.max(...size) / (isEmpty ? 1 : cells);
  const points = size.map((s) => Math.max(2, Math.ceil(s / step) + 1));
  const cell = size.map((s, i) => s / (points[i] - 1));
  const grid = { slice, most, cells, isEmpty, low, high, points, step: Math.max(...cell),
                 slopes: slopesOf(uniforms, [low, high]), handle: texture(gl.RG16F, points, gl.LINEAR) };
  for (let layer = 0; layer < points[2]; ++layer) {
    uploadFactors(map.factors);
    drawTo(grid.handle, points[0], points[1], layer);
    use(layers, { ...uniforms, low, cell, layer });
    drawAll();
    if (layer % 4 === 3) await drawn();
  }
  await drawn();
  return grid;
}

export const bindGrid = (grid) => bind("grid", gl.TEXTURE_3D, grid.handle);
