// Puts the page together: what a change of the state sets off, and the buttons that save.
import { byId, canvas, fail, followTheme, isDarkTheme, resizeCanvas, root } from "./dom.js";
import { viewOf } from "./camera.js";
import { renderCommand, surfaceCommand } from "./command.js";
import { button, note, toggleControls } from "./controls.js";
import { offerFilm } from "./film.js";
import { offerHelp } from "./help.js";
import { frame, toShape } from "./map.js";
import { offerNine } from "./nine.js";
import { listen } from "./pointer.js";
import { askPicture, saveMap, savePicture } from "./save.js";
import { offerSnapshots, renewSnapshot } from "./snapshots.js";
import { change, followAddress, hasDarkBackdrop, onChange, state, written } from "./state.js";

const given = new URLSearchParams(location.search);
const fixed = /^(\d{1,4})x(\d{1,4})$/.exec(given.get("size") ?? "");
const samples = Math.min(64, Math.max(0, Math.floor(Number(given.get("samples") ?? 8)) || 0));
const report = (share) => {
  if (share > 0) byId("progress").value = share;
  else byId("progress").removeAttribute("value");  // how much is done is not known yet
};

/** What draws: { draw(options), drawSmall(values, width, height, isDark), pointAt(x, y), isCoarse(), mapFile(), rangeNow(), most }:
 * the first three as picture.js has them; `mapFile` gives { text, name }
 * of a file that is saved and, where its knobs are not turned, the command that turns them; `rangeNow` the material's range,
 * or null where each picture has its own; `most` pixels a side; `brush` that of brush.js, or none. */
let renderer = null;

/** Gives the canvas as many pixels as are seen of it, or as the address says; returns whether it had others. */
function fit() {
  const ratio = Math.min(devicePixelRatio, 2);
  const size = fixed ? [Number(fixed[1]), Number(fixed[2])] : [canvas.clientWidth * ratio, canvas.clientHeight * ratio].map(Math.round);
  canvas.classList.toggle("sized", Boolean(fixed));
  const [width, height] = size.map((v) => Math.min(Math.max(v, 1), renderer.most));
  const isNew = width !== canvas.width || height !== canvas.height;
  if (isNew) resizeCanvas(width, height);
  return isNew;
}

let isSaving = false, hasFailed = false;
let drawing = "";  // what is drawn, or being drawn
let refreshes = 0;

async function refresh(isMoving = false) {
  if (isSaving) return;
  root.dataset.state = "busy";
  const id = ++refreshes;
  try {
    if (!await renderer.draw({ samples, isMoving, isDark: hasDarkBackdrop(), report })) {
      if (id === refreshes) drawing = "";  // a small picture has ended it
      return;
    }
    if (hasFailed) note("");
    hasFailed = false;
    root.dataset.state = "done";
    renewSnapshot();
  } catch (error) {
    hasFailed = true;
    fail(error);
  }
}

/** Draws what is not yet drawn. */
function showChange(settled) {
  const wanted = [written(), canvas.width, canvas.height, root.dataset.theme].join();
  if (wanted === drawing && !(settled && renderer.isCoarse())) return;
  drawing = wanted;
  refresh(!settled);
}

const commandNow = () => renderCommand(canvas.width, canvas.height, renderer.rangeNow());

/** The point in the middle and a pixel's width there, shape units and CSS pixels. */
function whereNow() {
  const view = viewOf(state, canvas.width, canvas.height, 1);
  const ratio = canvas.width / canvas.clientWidth;
  return { middle: toShape(view.middle), pixel: view.footprint * ratio / frame.scale };
}

/** Puts what is seen at a place into the middle. */
async function lookAt(x, y) {
  try {
    const point = await renderer.pointAt(x, y);
    if (point) change({ look: point });
  } catch (error) {
    note(error.message, 8);
  }
}

async function copy(text, words = "copied: ") {
  try {
    await navigator.clipboard.writeText(text);
    note(words + text, 6);
  } catch {
    note(text, 30);  // to be copied by hand
  }
}

async function savePictureAsAsked() {
  if (isSaving) return;
  const wanted = await askPicture(canvas, renderer.most);
  if (!wanted) return;
  isSaving = true;
  const before = [canvas.width, canvas.height];
  try {
    root.dataset.state = "busy";
    resizeCanvas(wanted.width, wanted.height);
    await renderer.draw({ samples: Math.max(samples, 8), isDark: hasDarkBackdrop(), report });
    await savePicture(canvas, wanted);
  } catch (error) {
    note(error.message, 8);
  }
  resizeCanvas(...before);
  isSaving = false;
  if (!fixed) fit();
  refresh();
}

offerSnapshots();
const filmAt = offerFilm();
offerHelp();
byId("savers").append(
  button("Copy as command", "Copies the qjulia render line that makes this picture", () => copy(commandNow())),
  button("Copy surface command", "Copies the qjulia surface line that makes a mesh of this set", () => copy(surfaceCommand())),
  button("Copy link", "Copies the address of this page with all that is set: a link is a shape", () => copy(location.href)),
  button("Save picture", "Saves a picture whose size you choose", savePictureAsAsked),
  button("Save map", root.dataset.renderer === "webgl" ? "Saves the map as it was shared, and copies the command that turns its knobs"
                                                       : "Saves the map with its knobs turned, as a file for qjulia", async () => {
    const saved = await renderer.mapFile();
    if (saved) saveMap(saved.text, saved.name);
    if (saved?.command) copy(saved.command, "saved as it was shared; copied, to turn its knobs: ");
  }),
  button("Dark or light", "Changes the theme of the page, and of the backdrop unless one is chosen", () => {
    root.dataset.theme = isDarkTheme() ? "light" : "dark";
    showChange(true);
  }));

/** Draws what is seen once more: the map has changed. */
export function redraw() {
  drawing = "";
  showChange(true);
}

/** Begins: draws what the address says, then whatever changes. */
export function start(draws) {
  renderer = draws;
  followTheme();
  if (fixed || innerWidth < 640) toggleControls();
  fit();
  const surprise = offerNine((values, ...size) => renderer.drawSmall(values, ...size, hasDarkBackdrop(values)), () => showChange(true));
  byId("actions").append(button("Surprise me", "Shows nine sets that differ widely; once you have taken one, nine that are like it (S)", surprise));
  listen({ whereNow, lookAt, surprise, brush: renderer.brush });
  followAddress();
  onChange(showChange);
  addEventListener("hashchange", followAddress);
  new ResizeObserver(() => {
    if (!fixed && !isSaving && fit()) showChange(true);
  }).observe(canvas);
  showChange(true);
  // For programs that drive the page, tests among them.
  globalThis.qjulia = { state, change, filmAt, renderCommand: commandNow, surfaceCommand };
}
