// A picture of the state, from coarse to fine, then with samples between the pixels' middles.
import { canvas, tellPass } from "./dom.js";
import { bind, drawAll, drawn, drawTo, gl, keptTexture, program, use, waits } from "./gl.js";
import { viewOf } from "./camera.js";
import { bindGrid } from "./grid.js";
import { marchView, measure } from "./march.js";
import { makeScene, seenBox } from "./scene.js";
import { knobsOf, palettes, state } from "./state.js";

/** The uniforms of shade.glsl: the colours of clay, and those that traits go through. */
function paletteOf(name) {
  const { clay, stops } = palettes[name], all = Array.from({ length: 8 }, (_, i) => stops[Math.min(i, stops.length - 1)]);
  return { palette_clay: clay, palette_stops: all, palette_last: stops.length - 1 };
}

const shade = program("shade.glsl"), show = program("show.glsl"), trait = program("trait.glsl");

/** For measurements: milliseconds of the last picture's parts. */
export const figures = {};

let latest = 0;   // the newest picture that was asked for; older ones stop at their next draw
let finest = null;  // the last whole march
let isMeasured = false;
let coarsest = Promise.resolve();  // the first picture that is being drawn

const traitKinds = { iterations: 0, trap: 1, groove: 2, factor: 3, height: 4 };  // as trait.glsl knows them

/** What the material shows at each pixel, for points as wide as `width`, into a texture. */
function drawTraits(scene, { view, depths }, jitter, width) {
  const traits = keptTexture("traits", gl.R32F, view.columns, view.rows), { scale, translation } = scene.map.shape_to_map;
  const sum = (a, b) => a.reduce((total, each, i) => total + each * b[i], 0);
  bind("depths", gl.TEXTURE_2D, depths);
  bindGrid(scene.grid);
  drawTo(traits, view.columns, view.rows);
  use(trait, { ...scene.uniforms, ...view, jitter, width, kind: traitKinds[state.material],
               height: [...view.upright, -sum(view.upright, translation)].map((c) => c / scale) });
  drawAll();
  return traits;
}

const parts = 8, even = Array.from({ length: parts + 1 }, (_, i) => i / parts), mix = (a, b, way) => a + way * (b - a);
/** The nearest values that rise by at least the gap each: host/picture/material_range.cpp. */
function apart(values, gap) {
  const pools = [];
  values.forEach((value, i) => {
    pools.push({ mean: value - gap * i, count: 1 });
    while (pools.length > 1 && pools.at(-2).mean > pools.at(-1).mean) {
      const last = pools.pop(), into = pools.at(-1), count = into.count + last.count;
      Object.assign(into, { mean: (into.mean * into.count + last.mean * last.count) / count, count });
    }
  });
  return pools.flatMap(({ mean, count }) => Array(count).fill(mean)).map((mean, i) => mean + gap * i);
}

let spread = { key: "", values: even };  // values of the material that divide the palette into equal parts

/** So that each part of the palette is seen about as much when material, iterations or knobs change; the camera changes
 * nothing. host/picture/material_range.cpp. */
function rangeOf(scene, result, jitter) {
  const key = JSON.stringify([state.material, state.iterations, knobsOf()]), { columns, rows } = result.view;
  if (key === spread.key) return spread.values;
  // As wide as a pixel of the whole picture at zoom 1.
  drawTraits(scene, result, jitter, result.view.footprint / result.view.divisor * state.zoom);
  const all = new Float32Array(4 * columns * rows);
  gl.readPixels(0, 0, columns, rows, gl.RGBA, gl.FLOAT, all);
  const found = all.filter((value, i) => i % 4 === 0 && value > -1e29).sort();
  if (found.length === 0) return spread.values;
  const tail = 0.02, at = (share) => found[Math.round(mix(tail, 1 - tail, share) * (found.length - 1))];
  const middle = (at(0) + at(1)) / 2, half = Math.max(at(1) - at(0), state.material === "height" ? 1e-6 : 1e-3) / 2;
  const isEven = !["iterations", "trap", "groove"].includes(state.material) || at(1) - at(0) < 2 * half;
  const values = isEven ? even.map((way) => mix(middle - half, middle + half, way)) : apart(even.map(at), half / (2 * parts));
  spread = { key, values };
  return values;
}

/** Colours of a march into the accumulated picture, of which they are this share; then all of it to the canvas. */
function paint(scene, result, jitter, share, isDark) {
  const { view, depths } = result, { width, height } = canvas;
  let traits = null, trait_range = even;
  if (state.material !== "clay") {
    trait_range = rangeOf(scene, result, jitter);
    traits = drawTraits(scene, result, jitter, view.footprint);
  }
  const picture = keptTexture("picture", gl.RGBA16F, width, height);
  bind("depths", gl.TEXTURE_2D, depths);
  bind("traits", gl.TEXTURE_2D, traits);
  drawTo(picture, width, height);
  gl.enable(gl.BLEND);
  gl.blendColor(0, 0, 0, share);
  gl.blendFunc(gl.CONSTANT_ALPHA, gl.ONE_MINUS_CONSTANT_ALPHA);
  use(shade, { ...view, ...paletteOf(state.palette), jitter, trait_range, has_traits: traits !== null, is_dark: isDark });
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
  const { scene, seen, view, middle } = await first, all = 1.33 + samples;
  if (isStale()) return false;
  let result = null, done = 0;
  report((done += 1 / 64) / all);
  for (const divisor of [4, 2, 1]) {
    // Without hints: those of a coarser picture may lie behind a thin wall.
    result = await marchView(scene, view(divisor), seen, divisor, middle, null, isStale);
    if (!result) return false;
    paint(scene, result, middle, 1, isDark);
    await drawn();
    report((done += 1 / divisor ** 2) / all);
  }
  finest = result;
  figures.fullMs = performance.now() - start;
  for (let k = 1; k <= samples; ++k) {
    const jitter = [(k * 0.7548776662) % 1 - 0.5, (k * 0.5698402910) % 1 - 0.5];
    const sample = await marchView(scene, view(1), seen, "sample", jitter, result, isStale);
    if (!sample) return false;
    paint(scene, sample, jitter, 1 / (k + 1), isDark);
    await drawn();
    report((done += 1) / all);
  }
  figures.longestWaitMs = waits.longest;
  return !isStale();
}

/** The scene of the state, drawn with an eighth of the pixels a side. */
async function drawCoarsest(options, start) {
  const scene = await makeScene(knobsOf(), state.iterations, options.isMoving);
  if (!isMeasured) measure(scene.uniforms);
  isMeasured = true;
  figures.sceneMs = performance.now() - start;
  waits.longest = 0;
  const seen = seenBox(scene.map, state), size = [canvas.width, canvas.height], camera = { ...state };
  const view = (divisor) => viewOf(camera, scene.map, ...size, divisor), middle = [0, 0];
  const result = await marchView(scene, view(8), seen, 8, middle, null, () => false);
  paint(scene, result, middle, 1, options.isDark);
  await drawn();
  figures.firstMs = performance.now() - start;
  return { scene, seen, view, middle };
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
