// The page of `qjulia explore`: the server's device draws, a picture a request, from coarse to fine.
import { canvas, tellPass } from "./dom.js";
import { offerBrush } from "./brush.js";
import { queryOf } from "./command.js";
import { offerLooks } from "./looks.js";
import { offerFiles } from "./make.js";
import { offerOthers } from "./others.js";
import { redraw, start } from "./page.js";
import { mapFileName } from "./save.js";
import { ask, asked_json } from "./server.js";
import { isOutlined, setOutline, turnOf } from "./outline.js";
import { state } from "./state.js";

const context = canvas.getContext("2d");
let newest = 0, request = null;

/** Milliseconds of the last picture's parts, and how many pictures there were: for measurements. */
const served = { frames: [], count: 0 };

/** What a picture's parts ask for: drafts, the first of at most some 160 x 120, then the whole. */
function stages(width, height, samples) {
  const coarsest = Math.max(1, Math.sqrt(width * height / (160 * 120)));
  const drafts = [coarsest, coarsest / 2.5].filter((ratio, i) => i === 0 || ratio > 1.2)
    .map((ratio) => ({ size: `${Math.ceil(width / ratio)}x${Math.ceil(height / ratio)}`, samples: 1, draft: 1 }));
  return [...drafts, { size: `${width}x${height}`, samples: samples > 0 ? 2 : 1 }];
}

/** Has the outline turned as the state turns the shape. */
async function followTurn() {
  if (isOutlined()) return;
  const turn = turnOf(state);
  setOutline(turn, await asked_json("outline", "GET", { rotate: turn }));
}

let draft = Promise.resolve();  // the draft that is being drawn

/** Draws one of the stages; whether it is still wanted. */
async function drawStage(stage, isStale, begin, options) {
  const picture = await ask("frame", { ...queryOf(), ...stage }, options);
  if (!picture || isStale()) return false;
  const image = await createImageBitmap(picture);
  context.drawImage(image, 0, 0, canvas.width, canvas.height);
  tellPass(1);
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
  await followTurn();
  if (isStale()) return false;
  served.frames = [];
  const all = stages(canvas.width, canvas.height, options.samples);
  try {
    const first = drawStage(all[0], () => false, begin, {});
    draft = first.catch(() => {});
    if (!await first || isStale()) return false;
    const report = (share) => { if (!isStale()) options.report(share); };
    for (const stage of all.slice(1)) {
      if (!await drawStage(stage, isStale, begin, { signal, report })) return false;
    }
  } catch (error) {
    if (isStale()) return false;
    throw error;
  }
  return true;
}

/** A small picture of a state, as ImageData; null where another was asked for in between. @param as for what. */
async function drawSmallServed(values, width, height, as = "small") {
  const bytes = await ask("frame", { ...queryOf(values, width, height), size: `${width}x${height}`, samples: 1, draft: 1, apart: 1 }, { as });
  if (!bytes) return null;
  const drawing = new OffscreenCanvas(width, height).getContext("2d");
  drawing.drawImage(await createImageBitmap(bytes), 0, 0);
  return drawing.getImageData(0, 0, width, height);
}

/** How a picture is asked for in which the server looks for points. */
function queryOfPoints() {
  const { size } = stages(canvas.width, canvas.height, 1).at(-2);
  return { ...queryOf(), size, samples: 1, draft: 1 };
}

/** The point of the set that is seen at a place, as pointAt of picture.js has it. */
async function pointServed(x, y) {
  const bytes = await ask("point", { ...queryOfPoints(), at: `${x},${y}` }, { as: "point" });
  return bytes && JSON.parse(await bytes.text());
}

/** Null where the map was asked for again in between. */
async function servedMap() {
  const bytes = await ask("map", queryOf());
  return bytes && { text: await bytes.text(), name: mapFileName("_turned") };
}

offerLooks((values, ...size) => drawSmallServed(values, ...size, "looks"));
const brush = offerBrush(queryOfPoints, redraw);
offerOthers();
offerFiles();
start({ brush, draw: drawServed, drawSmall: (values, width, height) => drawSmallServed(values, width, height), pointAt: pointServed, isCoarse: () => false, mapFile: servedMap, rangeNow: () => null, most: 4096 });
Object.assign(globalThis.qjulia, { figures: served, mapFile: servedMap });
