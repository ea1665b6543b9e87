// Marches the rays of a view: a few turns of each per draw, over as many tiles at once as should take
// about 25 ms.
import { anyPassed, bind, drawAll, drawn, drawTo, gl, keptTexture, program, use } from "./gl.js";
import { bindGrid } from "./grid.js";
import { evaluate } from "./points.js";

const march = program("march.glsl");
const turns = 8;      // that a ray takes in a draw call
const drawMs = 25;    // aimed at between two waits; a tile's draw takes it at most, as measured
const batch = 6;      // tiles drawn together while nothing is known of them
const anyDrawn = gl.createQuery();
let turnMs = 0;       // that a pixel takes, at most

/** Times an image and two F of a point. */
export function measure(uniforms) {
  const time = (count) => {
    const points = new Float32Array(4 * count);
    for (let i = 0; i < count; ++i) points.set([0.3 + 1e-5 * i, 0.2, 0.1, 0], 4 * i);
    const start = performance.now();
    evaluate(uniforms, points, 2);
    return performance.now() - start;
  };
  time(64);  // drivers finish compiling at the first draw
  for (let count = 1024, ms = 0; count <= 16384 && ms < 20; count *= 2) {
    ms = time(count);
    turnMs = ms / count;
  }
}

/** Depths of a whole view: { view, depths } with a texture as march.glsl says; null where isStale() says,
 * meanwhile, that nobody waits for it. @param coarse such a result whose depths are hints, or null. */
export async function marchView(uniforms, view, name, jitter, coarse, isStale) {
  const { columns, rows } = view;
  const values = {
    ...uniforms, ...view, jitter, turns,
    hint_step: coarse ? coarse.view.footprint : 0, hint_divisor: coarse ? coarse.view.divisor / view.divisor : 1,
  };
  const pair = [0, 1].map((i) => keptTexture(`${name} ${i}`, gl.RGBA32F, columns, rows));
  const side = Math.max(8, Math.min(4096, Math.round(Math.sqrt(drawMs / turns / turnMs) / 8) * 8));
  const across = Math.ceil(columns / side), tiles = across * Math.ceil(rows / side);
  const costs = new Float32Array(tiles).fill(drawMs / batch);  // that each tile's last draw took, ms
  const finished = new Uint8Array(tiles);
  for (let draw = 0, alive = true; alive; ++draw) {
    alive = false;
    for (let from = 0, to = 0; from < tiles; from = to) {
      to = from + 1;
      if (finished[from]) continue;
      if (isStale()) return null;
      let expected = costs[from];
      for (; to < tiles && !finished[to] && expected + costs[to] <= drawMs; ++to) expected += costs[to];
      bindGrid();
      bind("hints", gl.TEXTURE_2D, coarse ? coarse.depths : pair[1 - draw % 2]);
      bind("before", gl.TEXTURE_2D, pair[1 - draw % 2]);
      drawTo(pair[draw % 2], columns, rows);
      use(march, { ...values, draw });
      gl.beginQuery(gl.ANY_SAMPLES_PASSED, anyDrawn);
      gl.enable(gl.SCISSOR_TEST);
      for (let tile = from, count; tile < to; tile += count) {  // those of a row at once
        const column = tile % across;
        count = Math.min(across - column, to - tile);
        gl.scissor(column * side, (tile - column) / across * side, count * side, side);
        drawAll();
      }
      gl.disable(gl.SCISSOR_TEST);
      gl.endQuery(gl.ANY_SAMPLES_PASSED);
      const cost = await drawn() / (to - from);
      // A coarse clock may say 0.
      for (let tile = from; tile < to; ++tile) costs[tile] = Math.max(cost, costs[tile] / 4);
      if (await anyPassed(anyDrawn)) alive = true;
      else finished.fill(1, from, to);
    }
  }
  return { view, depths: pair[0] };
}
