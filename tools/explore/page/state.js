// What the controls say: one flat object, which the address holds too. A link is a shape.
import { byId, darkBackground, isDarkTheme } from "./dom.js";
import { settings } from "./settings.js";
import { axisOf, phaseOf } from "./vectors.js";

/** Colours by the palettes' names, the default's first. */
export const palettes = JSON.parse(byId("palettes").textContent);

const all = [...settings.map, ...settings.picture], controls = all.flatMap((setting) => setting.controls);
const cutNames = ["cutx", "cuty", "cutz"];  // per cent of the box
const backdrops = ["as the theme", "light", "dark"];

/** Every number: [usual, least, most]. */
export const ranges = Object.fromEntries([
  ...controls.filter((control) => control.least !== undefined).map(({ name, usual, least, most }) => [name, [usual, least, most]]),
  ...cutNames.map((name) => [name, [100, 1, 100]]),
]);
const whole = controls.filter((control) => control.whole).map((control) => control.name);

/** Every word: the usual first. */
export const words = Object.fromEntries([
  ...controls.filter((control) => control.words).map(({ name, words: list }) => [name, list]), ["backdrop", backdrops],
]);

/** What every control says where nothing is changed; a point in the picture's middle and a distance from it are null. */
export const usual = Object.fromEntries([...controls.map((control) => [control.name, control.usual]), ...cutNames.map((name) => [name, 100]),
                                         ["backdrop", backdrops[0]]]);

/** The state now. Change it through `change`. */
export const state = { ...usual };
/** Whether any of these differs from the usual. */
export const differ = (values, ...names) => names.some((name) => values[name] !== usual[name]);
export const differs = (...names) => differ(state, ...names);

/** Whether what is behind the set is dark. What a look says of it holds where nothing else is chosen. */
export const hasDarkBackdrop = (values = state) => values.backdrop === "dark" ||
  (values.backdrop === backdrops[0] && values.wears === usual.wears && isDarkTheme());

/** The options that the backdrop gives: [name, value]. A light one is the usual, and is said where a look has another. */
export const backdropOptions = (values = state) => hasDarkBackdrop(values) ? [["background", darkBackground]]
  : values.backdrop === "light" && values.wears !== usual.wears ? [["background", "studio"]] : [];

/** The names of a setting's controls. */
export const namesOf = (setting) => setting.controls.map((control) => control.name);

const valueMakers = {
  phase: phaseOf,
  rotation: ([degrees, axis]) => [...axisOf(axis), degrees],
  point: ([point]) => point,
  lamp: (values) => [values.map(short).join(",")],
};

/** The numbers or words that a setting stands at, as an option takes them. */
export const valuesOf = (setting, values) => (valueMakers[setting.type] ?? ((list) => list))(namesOf(setting).map((name) => values[name]));

/** Options that differ from the usual, of "map" or "picture": [option, values]. */
export const changed = (part, values = state) => settings[part].filter((setting) => differ(values, ...namesOf(setting)))
  .map((setting) => [setting.option, valuesOf(setting, values).map(short)]);

/** The knobs that a state stands for, as shaders take them. @param ownPhase that of the map's file. */
export function knobsOf(ownPhase, values = state) {
  const { detail = 1, drift = 0, scale, steepness, slice, phase1, phase2, phase3 } = values;
  return { detail, drift, scale, steepness, slice,
           phase: differ(values, "phase1", "phase2", "phase3") ? phaseOf([phase1, phase2, phase3]) : ownPhase };
}

const isIn = (name, value) => Number.isFinite(value) && value >= ranges[name][1] && value <= ranges[name][2] &&
                              (!whole.includes(name) || Number.isInteger(value));

/** The state that a text such as "detail=0.03&material=trap" names; what it makes no sense of stays usual. */
export function read(text) {
  const result = { ...usual };
  for (const [given, value] of new URLSearchParams(text)) {
    const name = given === "tufts" ? "steepness" : given;  // its name in older links
    if (Object.hasOwn(ranges, name) && value !== "" && isIn(name, Number(value))) result[name] = Number(value);
    if (Object.hasOwn(words, name) && words[name].includes(value)) result[name] = value;
    if (name === "look") {
      const point = value.split(",").map(Number);
      if (point.length === 3 && point.every(Number.isFinite)) result.look = point;
    }
    if (name === "distance" && Number(value) > 0 && Number.isFinite(Number(value))) result.distance = Number(value);
  }
  return result;
}

export const short = (v) => String(typeof v === "number" ? Number(v.toPrecision(7)) : v);

/** What differs from the usual, as that text. */
export function written(values = state) {
  return Object.keys(usual).filter((name) => String(values[name]) !== String(usual[name]))
    .map((name) => `${name}=${name === "look" ? values.look.map(short).join(",") : short(values[name])}`).join("&");
}

const listeners = [];
/** `call` gets whether the change has come to rest. */
export const onChange = (call) => listeners.push(call);
const tell = (settled) => listeners.forEach((call) => call(settled));

// ---- undo: what stood before each change that came to rest ----
const past = [], future = [];
let atRest = { ...state };

function rest() {
  atRest = { ...state };
  history.replaceState(null, "", "#" + written());
}

/** Sets some of the state. `settled` false: more of the same change will follow, as while a slider is dragged. */
export function change(values, settled = true) {
  for (const [name, value] of Object.entries(values)) {
    state[name] = Object.hasOwn(ranges, name) && name !== "azimuth"
      ? Math.min(Math.max(value, ranges[name][1]), ranges[name][2]) : value;
  }
  state.azimuth = ((state.azimuth + 180) % 360 + 360) % 360 - 180;
  if (settled) settle();
  tell(settled);
}

export function settle() {
  if (written(atRest) === written()) return;
  past.push(atRest);
  future.length = 0;
  rest();
}

function step(from, to) {
  if (from.length === 0) return;
  to.push({ ...state });
  Object.assign(state, from.pop());
  rest();
  tell(true);
}
export const undo = () => step(past, future);
export const redo = () => step(future, past);
export const canUndo = () => past.length > 0;
export const canRedo = () => future.length > 0;

/** Takes the state of the address. */
export function followAddress() {
  Object.assign(state, read(location.hash.slice(1)));
  atRest = { ...state };
  tell(true);
}
