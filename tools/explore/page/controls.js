// The panel: what sets each setting of the page, and buttons.
import { exploreCommand } from "./command.js";
import { byId, element, root } from "./dom.js";
import { frame } from "./map.js";
import { bears, settings } from "./settings.js";
import { canRedo, canUndo, change, onChange, ranges, redo, state, undo, usual, words } from "./state.js";

const updates = [];  // what follows the state

/** A line of the panel: a name, and what sets it. */
export const line = (text, title, ...fields) => element("label", { title }, element("span", {}, text), ...fields);

export const button = (text, title, onclick) => element("button", { type: "button", title, onclick }, text);

/** A menu of [value, text]. */
export const select = (name, entries, onchange) =>
  element("select", { name, onchange }, ...entries.map(([value, text]) => element("option", { value }, text)));

/** A slider with a number beside it. `isLog`: equal ways multiply the value by the same. */
function slider({ name, label: text, help: title, step, log: isLog = false, whole: isWhole = false }) {
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
    if (number.value !== "" && Number.isFinite(value)) change({ [name]: isWhole ? Math.round(value) : value });
    follow();
  });
  const follow = () => {
    range.value = toWay(state[name]);
    number.value = Number(state[name].toPrecision(4));
  };
  updates.push(follow);
  return line(text, title, range, number);
}

function menu({ name, label: text, help: title }) {
  const list = select(name, words[name].map((word) => [word, word]), () => change({ [name]: list.value }));
  updates.push(() => { list.value = state[name]; });
  return line(text, title, list);
}

export function group(title, ...children) {
  byId("knobs").append(element("fieldset", {}, element("legend", {}, title), ...children.filter(Boolean)));
}

/** Settings that show what the knobs can do: those the map does not bear are left out. */
const presets = {
  smooth: { detail: usual.detail / 8 }, clear: { detail: usual.detail / 2 }, wild: { detail: usual.detail * 2, iterations: 8 },
  "the fitted shape": { iterations: 1 }, "few octaves": { iterations: 2 },
  crust: { drift: 0.8, detail: Math.max(usual.detail, 0.03) }, "cut open": { cutz: 50, azimuth: 20 },
  "short tufts": { steepness: 6, detail: usual.detail * 1.5 }, "by iterations": { material: "iterations" }, "by trap": { material: "trap" },
};
const isThere = (knob) => knob === "cutz" ? Boolean(frame.box) : Object.hasOwn(usual, knob);

function presetMenu() {
  const names = Object.keys(presets).filter((name) => Object.keys(presets[name]).every(isThere));
  const list = select("preset", [["", "choose"], ["usual", "as the map is"], ...names.map((name) => [name, name])], () => {
    const camera = Object.fromEntries(["azimuth", "elevation", "zoom", "look", "up"].map((name) => [name, state[name]]));
    change({ ...usual, ...camera, ...presets[list.value] });
    list.value = "";
  });
  return line("preset", "Sets what shows best what the knobs can do", list);
}

const undoButton = button("Undo", "Takes back the last change (Ctrl+Z)", undo), redoButton = button("Redo", "Does again what was taken back (Ctrl+Shift+Z)", redo);
byId("actions").append(undoButton, redoButton, button("Reset", "Sets all as the map is", () => change({ ...usual })));
updates.push(() => { undoButton.disabled = !canUndo(); redoButton.disabled = !canRedo(); });

/** What sets the settings of a group. */
const fields = (title) => [...settings.map, ...settings.picture].filter((setting) => setting.group === title)
  .flatMap((setting) => setting.controls).map((control) => control.words ? menu(control) : slider(control));

group("Fractal", presetMenu(), ...fields("Fractal"));
group("Pattern", ...fields("Pattern"),
  bears("order-seed") && button("Shuffle", "Puts the factors into another order, which makes other grooves", () => change({ order: 1 + Math.floor(999999 * Math.random()) })));
group("Shape", ...fields("Shape"));
if (frame.box) {
  group("Cut open", ...["x", "y", "z"].map((axis) =>
    slider({ name: "cut" + axis, label: axis, help: `Cuts away what lies beyond this place along ${axis}, per cent of the shape's box`, step: 1 })));
}
group("Look", ...fields("Look"), menu({ name: "backdrop", label: "backdrop", help: "Says what is behind the set" }));

if (settings.absent.length > 0) {
  group("Not on this page", element("p", {}, `It takes a server to set ${settings.absent.join(", ")}: `,
                                    element("code", {}, exploreCommand())));
}

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
