// The page of `qjulia explore`: the server's device draws, a picture a request, from coarse to fine.
import { canvas } from "./canvas.js";
import { queryOf } from "./command.js";
import { offerFiles } from "./make.js";
import { start } from "./page.js";
import { ask } from "./server.js";

const context = canvas.getContext("2d");
let newest = 0, request = null;

/** Milliseconds of the last picture's parts, and how many pictures there were: for measurements. */
const served = { frames: [], count: 0 };

/** What a picture's parts ask for: the first a draft of at most some 160 x 120. */
function stages(width, height, samples) {
  const coarsest = Math.max(1, Math.sqrt(width * height / (160 * 120)));
  const ratios = [coarsest, coarsest / 2.5, 1].filter((ratio, i) => i === 0 || ratio > 1.2 || i === 2);
  const sizes = ratios.map((ratio, i) => ({ size: `${Math.ceil(width / ratio)}x${Math.ceil(height / ratio)}`, samples: 1,
                                            ...(i === 0 ? { draft: 1 } : {}) }));
  return samples > 0 ? [...sizes, { size: `${width}x${height}`, samples: 2 }] : sizes;
}

let draft = Promise.resolve();  // the draft that is being drawn

/** Draws one of the stages; whether it is still wanted. */
async function drawStage(stage, isStale, signal, begin) {
  const picture = await ask("frame", { ...queryOf(), ...stage }, { signal });
  if (!picture || isStale()) return false;
  const image = await createImageBitmap(picture);
  context.drawImage(image, 0, 0, canvas.width, canvas.height);
  served.frames.push({ ...stage, ms: performance.now() - begin });
  ++served.count;
  return true;
}

async function drawServed(options) {
  const id = ++newest, begin = performance.now(), isStale = () => id !== newest;
  request?.abort();
  request = new AbortController();
  const { signal } = request;
  // A draft is never cut short: while something moves, drafts are what keeps up.
  await draft;
  if (isStale()) return false;
  served.frames = [];
  const all = stages(canvas.width, canvas.height, options.samples);
  try {
    const first = drawStage(all[0], () => false, null, begin);
    draft = first.catch(() => {});
    if (!await first || isStale()) return false;
    for (const [i, stage] of all.entries()) {
      if (i > 0 && !await drawStage(stage, isStale, signal, begin)) return false;
      options.report?.((i + 1) / all.length);
    }
  } catch (error) {
    if (isStale()) return false;
    throw error;
  }
  return true;
}

const servedMap = async () => (await ask("map", queryOf())).text();

offerFiles();
start({ draw: drawServed, isCoarse: () => false, mapFile: servedMap, most: 4096 });
Object.assign(globalThis.qjulia, { figures: served, mapFile: servedMap });
