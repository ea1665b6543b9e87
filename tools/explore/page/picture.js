// A picture of the state, from coarse to fine, then with samples between the pixels' middles.
import { canvas, tellPass } from "./dom.js";
import { bind, drawAll, drawn, drawTo, gl, keptTexture, program, use, waits } from "./gl.js";
import { viewOf } from "./camera.js";
import { gridOf } from "./grid.js";
import { marchView, measure } from "./march.js";
import { look, scene } from "./scene.js";
import { knobsOf, palettes, state } from "./state.js";

/** The uniforms of shade.glsl: the colours of clay, and those that traits go through. */
function paletteOf(name) {
  const { clay, stops } = palettes[name], all = Array.from({ length: 8 }, (_, i) => stops[Math.min(i, stops.length - 1)]);
  return { palette_clay: clay, palette_stops: all, palette_last: stops.length - 1 };
}

/** The values of the material that divide the palette into equal parts, as the host has found them; null for clay. */
export const rangeNow = () => scene.ranges[state.material]?.[state.iterations - 1] ?? null;

const shade = program("shade.glsl"), show = program("show.glsl"), trait = program("trait.glsl");

/** For measurements: milliseconds of the last picture's parts. */
export const figures = {};

let latest = 0;   // the newest picture that was asked for; older ones stop at their next draw
let finest = null;  // the last whole march
let isMeasured = false;
let coarsest = Promise.resolve();  // the first picture that is being drawn

/** What the material shows at each pixel, into a texture. */
function drawTraits(uniforms, { view, depths }, jitter) {
  const traits = keptTexture("traits", gl.R32F, view.columns, view.rows);
  bind("depths", gl.TEXTURE_2D, depths);
  drawTo(traits, view.columns, view.rows);
  use(trait, { ...uniforms, ...view, jitter, width: view.footprint, kind: scene.traits[state.material] });
  drawAll();
  return traits;
}

/** Colours of a march into the accumulated picture, of which they are this share; then all of it to the canvas. */
function paint(uniforms, result, jitter, share, isDark) {
  const { view, depths } = result, { width, height } = canvas;
  const traits = state.material === "clay" ? null : drawTraits(uniforms, result, jitter);
  const picture = keptTexture("picture", gl.RGBA16F, width, height);
  bind("depths", gl.TEXTURE_2D, depths);
  bind("traits", gl.TEXTURE_2D, traits);
  drawTo(picture, width, height);
  gl.enable(gl.BLEND);
  gl.blendColor(0, 0, 0, share);
  gl.blendFunc(gl.CONSTANT_ALPHA, gl.ONE_MINUS_CONSTANT_ALPHA);
  use(shade, { ...view, ...paletteOf(state.palette), jitter, trait_range: rangeNow() ?? Array(9).fill(0), has_traits: traits !== null, is_dark: isDark });
  drawAll();
  gl.disable(gl.BLEND);
  bind("picture", gl.TEXTURE_2D, picture);
  drawTo(null, width, height);
  use(show, {});
  drawAll();
  tellPass(view.divisor);
}

/** Draws the state. Resolves with whether it came to the end: another call ends this one.
 * @param options samples: between pixels' middles, after the first; isMoving: more changes are on their way, and a coarse grid will do;
 * isDark: the backdrop; report(share): how much is done. */
export async function draw(options) {
  const { samples, isDark, report } = options;
  const id = ++latest, start = performance.now(), isStale = () => id !== latest;
  // A first picture is never cut short: while something moves, these are what keeps up.
  await coarsest;
  if (isStale()) return false;
  report(0);
  const first = drawCoarsest(options, start);
  coarsest = first.catch(() => {});
  const { uniforms, view, middle } = await first, all = 1.33 + samples;
  if (isStale()) return false;
  let result = null, done = 0;
  report((done += 1 / 64) / all);
  for (const divisor of [4, 2, 1]) {
    // Without hints: those of a coarser picture may lie behind a thin wall.
    result = await marchView(uniforms, view(divisor), divisor, middle, null, isStale);
    if (!result) return false;
    paint(uniforms, result, middle, 1, isDark);
    await drawn();
    report((done += 1 / divisor ** 2) / all);
  }
  finest = result;
  figures.fullMs = performance.now() - start;
  for (let k = 1; k <= samples; ++k) {
    const jitter = [(k * 0.7548776662) % 1 - 0.5, (k * 0.5698402910) % 1 - 0.5];
    const sample = await marchView(uniforms, view(1), "sample", jitter, result, isStale);
    if (!sample) return false;
    paint(uniforms, sample, jitter, 1 / (k + 1), isDark);
    await drawn();
    report((done += 1) / all);
  }
  figures.longestWaitMs = waits.longest;
  return !isStale();
}

/** The scene of the state, drawn with an eighth of the pixels a side. */
async function drawCoarsest(options, start) {
  const wanted = look(knobsOf(scene.phase), state.iterations);
  const cut = ["cutx", "cuty", "cutz"].map((name) => state[name] / 100);
  const uniforms = { ...wanted.uniforms, ...await gridOf(wanted, options.isMoving), cut };
  if (!isMeasured) measure(uniforms);
  isMeasured = true;
  figures.sceneMs = performance.now() - start;
  waits.longest = 0;
  const size = [canvas.width, canvas.height], camera = { ...state };
  const view = (divisor) => viewOf(camera, ...size, divisor), middle = [0, 0];
  const result = await marchView(uniforms, view(8), 8, middle, null, () => false);
  paint(uniforms, result, middle, 1, options.isDark);
  await drawn();
  figures.firstMs = performance.now() - start;
  return { uniforms, view, middle };
}

/** Depths along the rays of the last whole picture, row by row from the top, -1 where nothing is; and a pixel's
 * width in the middle. Map units. */
export function depths() {
  const { columns, rows } = finest.view, all = new Float32Array(4 * columns * rows);
  drawTo(finest.depths, columns, rows);
  gl.readPixels(0, 0, columns, rows, gl.RGBA, gl.FLOAT, all);
  const result = new Float32Array(columns * rows);
  for (let y = 0; y < rows; ++y) {
    for (let x = 0; x < columns; ++x) result[(rows - 1 - y) * columns + x] = all[4 * (y * columns + x)];
  }
  // As march.glsl counts them.
  const counts = all.filter((_, i) => i % 4 === 3), versors = counts.map((c) => Math.floor(c / 4096));
  const sum = (values) => values.reduce((a, b) => a + b, 0);
  return { columns, rows, depths: result, pixel: finest.view.footprint, fields: sum(counts) - 4096 * sum(versors), versors: sum(versors) };
}
