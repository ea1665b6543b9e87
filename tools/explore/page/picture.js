// A picture of the state, from coarse to fine, then with samples between the pixels' middles.
import { canvas, tellPass } from "./dom.js";
import { bind, drawAll, drawn, drawTo, gl, keptTexture, program, use, waits } from "./gl.js";
import { viewOf } from "./camera.js";
import { gridOf } from "./grid.js";
import { marchView, measure } from "./march.js";
import { toShape } from "./map.js";
import { look, scene } from "./scene.js";
import { knobsOf, palettes, state } from "./state.js";
import { plus } from "./vectors.js";

/** The uniforms of shade.glsl: the colours of clay, and those that traits go through. */
function paletteOf(name) {
  const { clay, stops } = palettes[name], all = Array.from({ length: 8 }, (_, i) => stops[Math.min(i, stops.length - 1)]);
  return { palette_clay: clay, palette_stops: all, palette_last: stops.length - 1 };
}

/** The values of the material that divide the palette into equal parts, as the host has found them; null for clay. */
const rangeOf = ({ material, iterations }) => scene.ranges[material]?.[iterations - 1] ?? null;
export const rangeNow = () => rangeOf(state);

const shade = program("shade.glsl"), show = program("show.glsl"), trait = program("trait.glsl");

/** For measurements: milliseconds of the last picture's parts. */
export const figures = {};

let latest = 0;   // the newest picture that was asked for; older ones stop at their next draw
let finest = null;  // the last whole march
let shown = null;   // the march on the canvas
let isMeasured = false;
let coarsest = Promise.resolve();  // the first picture that is being drawn, or a small one

/** What the material shows at each pixel, into a texture. */
function drawTraits(values, uniforms, { view, depths }, jitter) {
  const traits = keptTexture("traits", gl.R32F, view.columns, view.rows);
  bind("depths", gl.TEXTURE_2D, depths);
  drawTo(traits, view.columns, view.rows);
  use(trait, { ...uniforms, ...view, jitter, width: view.footprint, kind: scene.traits[values.material] });
  drawAll();
  return traits;
}

/** Colours of a march into a texture of this name and size, of which they are this share; it is bound to `picture`. */
function shadeTo(name, [width, height], values, uniforms, result, jitter, share, isDark) {
  const { view, depths } = result;
  const traits = values.material === "clay" ? null : drawTraits(values, uniforms, result, jitter);
  const picture = keptTexture(name, gl.RGBA16F, width, height);
  bind("depths", gl.TEXTURE_2D, depths);
  bind("traits", gl.TEXTURE_2D, traits);
  drawTo(picture, width, height);
  gl.enable(gl.BLEND);
  gl.blendColor(0, 0, 0, share);
  gl.blendFunc(gl.CONSTANT_ALPHA, gl.ONE_MINUS_CONSTANT_ALPHA);
  use(shade, { ...view, ...paletteOf(values.palette), jitter, trait_range: rangeOf(values) ?? Array(9).fill(0), has_traits: traits !== null, is_dark: isDark });
  drawAll();
  gl.disable(gl.BLEND);
  bind("picture", gl.TEXTURE_2D, picture);
}

/** The same into the accumulated picture; then all of it to the canvas. */
function paint(uniforms, result, jitter, share, isDark) {
  shadeTo("picture", [canvas.width, canvas.height], state, uniforms, result, jitter, share, isDark);
  drawTo(null, canvas.width, canvas.height);
  use(show, {});
  drawAll();
  tellPass(result.view.divisor);
  shown = result;
}

/** What shaders take of a state's map. @param isMoving a coarse grid will do. */
async function uniformsOf(values, isMoving) {
  const wanted = look(knobsOf(scene.phase, values), values.iterations);
  const cut = ["cutx", "cuty", "cutz"].map((name) => values[name] / 100);
  const uniforms = { ...wanted.uniforms, ...await gridOf(wanted, isMoving), cut };
  if (!isMeasured) measure(uniforms);
  isMeasured = true;
  return uniforms;
}

/** A small picture of a state, as ImageData. It ends the picture that is being drawn. */
export async function drawSmall(values, width, height, isDark) {
  ++latest;
  const before = coarsest;
  const made = (async () => {
    await before;
    const uniforms = await uniformsOf(values, true), jitter = [0, 0];
    const result = await marchView(uniforms, viewOf(values, width, height, 1), "small", jitter, null, () => false);
    shadeTo("small colours", [width, height], values, uniforms, result, jitter, 1, isDark);
    drawTo(keptTexture("small", gl.RGBA8, width, height), width, height);
    use(show, {});
    drawAll();
    const bytes = new Uint8Array(4 * width * height), image = new ImageData(width, height);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
    for (let y = 0; y < height; ++y) image.data.set(bytes.subarray(4 * width * y, 4 * width * (y + 1)), 4 * width * (height - 1 - y));
    return image;
  })();
  coarsest = made.catch(() => {});
  return made;
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
    paint(uniforms, { ...sample, isSample: true }, jitter, 1 / (k + 1), isDark);
    await drawn();
    report((done += 1) / all);
  }
  figures.longestWaitMs = waits.longest;
  return !isStale();
}

/** The scene of the state, drawn with an eighth of the pixels a side. */
async function drawCoarsest(options, start) {
  const uniforms = await uniformsOf(state, options.isMoving);
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

/** The point of the set that is seen at a place of the canvas, shares of its width and height from the upper left; shape
 * units; null where there is none. */
export function pointAt(x, y) {
  // Samples lie beside the pixels' middles, and the next one writes into the same texture.
  const { view, depths: texture } = shown.isSample ? finest : shown, [width, height] = view.canvas;
  if (width !== canvas.width || height !== canvas.height) return null;
  const at = [x * width, (1 - y) * height].map((v) => Math.floor(v / view.divisor)), found = new Float32Array(4);
  drawTo(texture, view.columns, view.rows);
  gl.readPixels(...at, 1, 1, gl.RGBA, gl.FLOAT, found);
  const [depth, , mode] = found, isDecided = mode >= 3;
  if (!isDecided || depth < 0) return null;
  const ray = plus(plus(view.dir, view.dir_dx, at[0] + 0.5), view.dir_dy, at[1] + 0.5);
  return toShape(plus(view.eye, ray, depth / Math.hypot(...ray)));
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
