// The panel: a slider and a number for each knob, menus, buttons. Its words are those of qjulia's help.
import { byId, element, root } from "./dom.js";
import { bears, map } from "./map.js";
import { canRedo, canUndo, change, onChange, ranges, redo, state, undo, usual, words } from "./state.js";

const updates = [];  // what follows the state

/** A line of the panel: a name, and what sets it. */
export const line = (text, title, ...fields) => element("label", { title }, element("span", {}, text), ...fields);

export const button = (text, title, onclick) => element("button", { type: "button", title, onclick }, text);

/** A menu of [value, text]. */
export const select = (name, entries, onchange) =>
  element("select", { name, onchange }, ...entries.map(([value, text]) => element("option", { value }, text)));

/** A slider with a number beside it. `isLog`: equal ways multiply the value by the same. */
function slider(name, text, title, step, isLog = false) {
  const [, least, most] = ranges[name];
  const toWay = (v) => isLog ? Math.log(v / least) / Math.log(most / least) : v;
  const toValue = (w) => isLog ? Number((least * (most / least) ** w).toPrecision(3)) : Number(w);
  const range = element("input", { type: "range", name, ...(isLog ? { min: 0, max: 1, step: 0.002 } : { min: least, max: most, step }) });
  const number = element("input", { type: "number", min: least, max: most, step: "any" });
  range.setAttribute("aria-label", text);
  number.setAttribute("aria-label", `${text}, number`);
  range.addEventListener("input", () => change({ [name]: toValue(Number(range.value)) }, false));
  range.addEventListener("change", () => change({}));
  number.addEventListener("change", () => {
    const value = Number(number.value);
    if (number.value !== "" && Number.isFinite(value)) change({ [name]: step >= 1 ? Math.round(value) : value });
    follow();
  });
  const follow = () => {
    range.value = toWay(state[name]);
    number.value = Number(state[name].toPrecision(4));
  };
  updates.push(follow);
  return line(text, title, range, number);
}

function menu(name, text, title) {
  const list = select(name, words[name].map((word) => [word, word]), () => change({ [name]: list.value }));
  updates.push(() => { list.value = state[name]; });
  return line(text, title, list);
}

export function group(title, ...children) {
  byId("knobs").append(element("fieldset", {}, element("legend", {}, title), ...children.filter(Boolean)));
}

/** Settings that show what the knobs can do: those the map does not bear are left out. */
const presets = {
  smooth: { detail: map.detail / 8 }, clear: { detail: map.detail / 2 }, wild: { detail: map.detail * 2, iterations: 8 },
  "the fitted shape": { iterations: 1 }, "few octaves": { iterations: 2 },
  crust: { drift: 0.8, detail: Math.max(map.detail, 0.03) }, "cut open": { cutz: 50, azimuth: 20 },
  "short tufts": { tufts: 6, detail: map.detail * 1.5 }, "by iterations": { material: "iterations" }, "by trap": { material: "trap" },
};
const needs = { detail: bears.detail, drift: bears.drift, cutz: Boolean(map.box) };

function presetMenu() {
  const names = Object.keys(presets).filter((name) => Object.keys(presets[name]).every((knob) => needs[knob] ?? true));
  const list = select("preset", [["", "choose"], ["usual", "as the map is"], ...names.map((name) => [name, name])], () => {
    const camera = Object.fromEntries(["azimuth", "elevation", "zoom", "look", "up"].map((name) => [name, state[name]]));
    change({ ...usual, ...camera, ...presets[list.value] });
    list.value = "";
  });
  return line("preset", "Settings that show what the knobs can do", list);
}

const someAngle = (most) => Math.round(Math.random() * most), someOrder = () => 1 + someAngle(999998);
export function surprise() {
  change({ phase1: someAngle(180), phase2: someAngle(180), phase3: someAngle(360) - 180, ...(bears.order ? { order: someOrder() } : {}) });
}

const undoButton = button("Undo", "Undo the last change (Ctrl+Z)", undo), redoButton = button("Redo", "Do it again (Ctrl+Shift+Z)", redo);
byId("actions").append(undoButton, redoButton,
  button("Surprise me", "A random phase and order of the factors: another pattern of grooves on the same shape", surprise),
  button("Reset", "All as the map is", () => change({ ...usual })));
updates.push(() => { undoButton.disabled = !canUndo(); redoButton.disabled = !canRedo(); });

group("Fractal", presetMenu(),
  bears.detail && slider("detail", "detail", "Thickness of the fractal shell, as a fraction of the shape's box diagonal: thicker is wilder", 0, true),
  slider("iterations", "iterations", "1 is the fitted shape itself, 2 and 3 have fewer octaves of detail, 6 is the set as it stays (8 where detail is above 0.03)", 1),
  slider("tufts", "tufts", "How many times as steep the field is outside the shape: above 1, tufts that stand off the shape are shorter", 0, true));
group("Pattern",
  slider("phase1", "phase", "First angle of the unit quaternion in front of the map, degrees: turns the pattern of grooves and keeps the shape", 1),
  slider("phase2", "phase, 2nd", "Second angle of the phase, degrees; it matters where the first is not 0", 1),
  slider("phase3", "phase, 3rd", "Third angle of the phase, degrees; it matters where the first two are not 0", 1),
  bears.order && slider("order", "order seed", "Shuffles the map's factors by this seed: another pattern of grooves on the same shape; 0 is the map's own order", 1),
  bears.order && button("Shuffle", "Another order of the factors", () => change({ order: someOrder() })));
group("Shape",
  bears.drift && slider("drift", "drift", "Moves the origin of iteration inside the shape, along z, in inradii: grooves deepen, near 1 the set is a hollow crust", 0.01),
  slider("slice", "slice", "Fourth coordinate of what is looked at, map units: away from 0 thin parts vanish first", 0.005),
  slider("scale", "scale", "Above 1 the set swells, below 1 it wears away", 0, true),
  bears.rotate && slider("rotate", "rotate", "Turns the factors, and the shape with them, about an axis through the origin of iteration, degrees", 1),
  bears.rotate && menu("axis", "about", "The axis: about x, the real axis, the grooves turn along; about the others they change"));
if (map.box) {
  group("Cut open", ...["x", "y", "z"].map((axis) =>
    slider("cut" + axis, axis, `Cuts away what lies beyond this place along ${axis}, per cent of the shape's box`, 1)));
}
group("Look",
  menu("material", "material", "What colours the set: clay; how late the orbit of a point is decided; or how close two iterates come to the plane X = 0"),
  menu("palette", "palette", "The set's colours: of clay, or those that the other materials go through from low to high"),
  slider("light", "light", "Strength of the lamp", 0.05),
  slider("lightaz", "from the side", "Where the lamp is, degrees from the camera to the right", 1),
  slider("lightup", "from above", "How high the lamp is, degrees", 1),
  menu("up", "up", "The shape's axis that points up"));

byId("panel").addEventListener("submit", (event) => event.preventDefault());
onChange(() => updates.forEach((update) => update()));

export function toggleControls() {
  const isOpen = root.dataset.controls === "open";
  root.dataset.controls = isOpen ? "closed" : "open";
  byId("fold").setAttribute("aria-expanded", String(!isOpen));
}
byId("fold").addEventListener("click", toggleControls);

let noteTimer = 0;
/** Says something for a while; for ever where `seconds` is 0. */
export function note(text, seconds = 4) {
  byId("note").textContent = text;
  clearTimeout(noteTimer);
  if (seconds > 0) noteTimer = setTimeout(() => { byId("note").textContent = ""; }, 1000 * seconds);
}
