// The page of `qjulia explore`: the server's device draws, a picture a request, from coarse to fine.
import { canvas } from "./canvas.js";
import { queryOf } from "./command.js";
import { start } from "./page.js";

const token = new URLSearchParams(location.search).get("token");
const client = crypto.randomUUID();
const context = canvas.getContext("2d");
let newest = 0, request = null;

/** What the server says to a request; null where another came in between. */
async function ask(path, query, signal) {
  const answer = await fetch(`${path}?${new URLSearchParams(query)}`,
                             { headers: { "X-Qjulia-Token": token, "X-Qjulia-Client": client }, signal });
  if (!answer.ok) throw new Error(await answer.text());
  const bytes = new Uint8Array(await answer.arrayBuffer()), kind = String.fromCharCode(bytes[0]);
  if (kind === "!") throw new Error(new TextDecoder().decode(bytes.subarray(1)));
  return kind === "=" ? bytes.subarray(1) : null;
}

/** Milliseconds of the last picture's parts: for measurements. */
const served = { frames: [] };

/** Sizes and samples of a picture, the first at most some 160 x 120. */
function stages(width, height, samples) {
  const coarsest = Math.max(1, Math.sqrt(width * height / (160 * 120)));
  const ratios = [coarsest, coarsest / 2.5, 1].filter((ratio, i) => i === 0 || ratio > 1.2 || i === 2);
  const sizes = [...new Set(ratios)].map((ratio) => [Math.ceil(width / ratio), Math.ceil(height / ratio), 1]);
  return samples > 0 ? [...sizes, [width, height, 2]] : sizes;
}

async function drawServed(options) {
  const id = ++newest, begin = performance.now();
  request?.abort();
  request = new AbortController();
  served.frames = [];
  const { width, height } = canvas, all = stages(width, height, options.samples);
  for (const [i, [wide, high, samples]] of all.entries()) {
    let picture;
    try {
      picture = await ask("frame", { ...queryOf(), size: `${wide}x${high}`, samples }, request.signal);
    } catch (error) {
      if (id !== newest) return false;
      throw error;
    }
    if (id !== newest || !picture) return false;
    const image = await createImageBitmap(new Blob([picture], { type: "image/png" }));
    if (id !== newest) return false;
    context.drawImage(image, 0, 0, width, height);
    served.frames.push({ size: `${wide}x${high}`, samples, ms: performance.now() - begin });
    options.report?.((i + 1) / all.length);
  }
  return true;
}

async function servedMap() {
  const bytes = await ask("map", queryOf());
  return new TextDecoder().decode(bytes);
}

start({ draw: drawServed, isCoarse: () => false, mapFile: servedMap, most: 4096 });
Object.assign(globalThis.qjulia, { figures: served, mapFile: servedMap });
