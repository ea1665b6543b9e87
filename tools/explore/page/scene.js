// The map as its knobs stand, ready to be drawn: calibrated, with the radii, grid and slopes that the
// march needs. Each is made again only where a knob changes it.
import { map, toMap, turned } from "./map.js";
import { effectiveRadius, extremes, stopRadii, uniformsOf } from "./field.js";
import { makeGrid, slopeAt } from "./grid.js";
import { gl, uploadFactors } from "./gl.js";
import { bears } from "./settings.js";
import { knobsOf, written } from "./state.js";
import { apply, plus, times, transpose } from "./vectors.js";

const coarseCells = 40, fineCells = 64;  // cells of a grid's longest side, while a slice moves and once it rests
let grid = null, table = null, calibration = null;

/** Whether the grid was made in haste. */
export const isCoarse = () => grid !== null && grid.cells < fineCells;

/** The map with its knobs turned, calibrated. @throws where the origin leaves the shape. */
function turnedMap(knobs) {
  const m = turned(knobs);
  if (knobs.drift !== 0 && bears("drift")) {
    const key = [knobs.drift, knobs.rotate, knobs.axis].join();
    if (calibration?.key !== key) {
      uploadFactors(m.factors);
      calibration = { key, radius: effectiveRadius(m) };
    }
    if (calibration.radius === 0) throw new Error("the drift moves the origin out of the shape: use less");
    m.log_scale += Math.log(calibration.radius) - m.surface_level;
    m.surface_level = Math.log(calibration.radius);
  }
  m.log_scale -= Math.log(knobs.scale);
  return m;
}

/** The map with its knobs turned, as a map file: what qjulia convert would make of it. */
export function mapFile() {
  const m = turnedMap(knobsOf());
  for (const key of ["steep", "turn", "offset"]) delete m[key];
  for (const portal of m.portals ?? []) delete portal.matrix;
  if (m.steepness === 1) delete m.steepness;
  if (m.steepness || m.diagonal) m.version = 2;
  m.provenance = { ...m.provenance, turned: { page: written() } };
  return JSON.stringify(m, null, 1) + "\n";
}

/** @param isMoving a coarse grid will do. */
export async function makeScene(knobs, iterations, isMoving) {
  const cells = isMoving ? coarseCells : fineCells;
  const m = turnedMap(knobs), level = m.surface_level ?? 0, base = level - Math.log(knobs.scale);
  if (table === null || table.drift !== knobs.drift) {  // not every map bears a drift
    // Turning about the origin changes nothing on spheres about it; detail and scale change it all alike.
    const plain = turned({ ...knobs, rotate: 0, order: 0, detail: map.detail });
    uploadFactors(plain.factors);
    table = { drift: knobs.drift, rows: extremes(plain) };
  }
  const steep = (f) => f > level ? level + m.steepness * (f - level) : f;
  const radii = stopRadii(table.rows, (g) => steep(m.steep * g + base), m);
  const radius = Math.min(radii.outer, radii.escape), far = iterations === 1 ? level : Math.log(radius);
  // Without steepness, so that it asks for no grid of its own.
  const needed = (Math.min(far, level + 6) - base) / m.steep;
  if (!grid || grid.slice !== knobs.slice || grid.most < needed || grid.cells < cells) {
    const next = await makeGrid(knobs.slice, Math.max(2.5, 1.3 * needed), cells);
    if (grid) gl.deleteTexture(grid.handle);
    grid = next;
  }
  uploadFactors(m.factors);
  const bent = (level + (far - level) / m.steepness - base) / m.steep;
  const steepest = Math.max(m.steep * m.steepness * slopeAt(grid, bent), 1e-3);
  return {
    map: m, grid,
    uniforms: { ...uniformsOf(m, radii), far_level: far, steepest, radius, iterations,
                to_grid: gridMatrix(m), grid_low: grid.low, grid_high: grid.high, grid_points: grid.points,
                grid_step: grid.step, grid_slope: m.steep, grid_base: base },
    shell: 1 / steepest,
  };
}

/** Columns of the matrix from map coordinates to the grid's, the file's: x = turn^T (p - offset). */
const gridMatrix = ({ turn, offset }) => [...turn.map((row) => [...row, 0]), [...times(-1, apply(transpose(turn), offset)), 1]];

/** What cuts leave, map coordinates. */
export function seenBox(m, state) {
  const far = 1e6, low = [-far, -far, -far], high = [far, far, far];
  if (m.box) {
    ["cutx", "cuty", "cutz"].forEach((name, i) => {
      if (state[name] >= 100) return;
      high[i] = toMap(plus(times(1 - state[name] / 100, m.box[0]), m.box[1], state[name] / 100), m)[i];
    });
  }
  return { seen_low: low, seen_high: high };
}
