// What the controls say: one flat object, which the address holds too. A link is a shape.
import { anglesOf, bears, map, mostDetail, phaseOf } from "./map.js";
import { byId } from "./dom.js";
import { axisOf } from "./vectors.js";

/** Colours by the palettes' names, the default's first. */
export const palettes = JSON.parse(byId("palettes").textContent);

const usualPhase = map.phase ?? [1, 0, 0, 0], usualAngles = anglesOf(usualPhase);

/** Every number: [usual, least, most]. */
export const ranges = {
  azimuth: [30, -180, 180], elevation: [15, -90, 90], zoom: [1, 0.1, 500],
  detail: [map.detail ?? 1, bears.detail ? Math.min(0.001, map.detail) : 1, bears.detail ? Math.max(mostDetail, map.detail) : 1],
  iterations: [6, 1, 16],
  phase1: [usualAngles[0], 0, 180], phase2: [usualAngles[1], 0, 180], phase3: [usualAngles[2], -180, 180],
  drift: [0, 0, 1.1], slice: [map.slice, Math.min(-1.5, map.slice), Math.max(1.5, map.slice)], scale: [1, 0.3, 3],
  rotate: [0, -180, 180], order: [0, 0, 999999], tufts: [map.tufts ?? 1, 1, 100],
  cutx: [100, 1, 100], cuty: [100, 1, 100], cutz: [100, 1, 100],
  lightaz: [-61.7, -180, 180], lightup: [41.4, -20, 90], light: [1, 0, 2],
};
const whole = ["iterations", "order"];

const standing = ["x", "y", "z", "-x", "-y", "-z"], ownUp = map.up ?? "y";
/** Every word: the usual first. */
export const words = { axis: ["x", "y", "z"], up: [ownUp, ...standing.filter((up) => up !== ownUp)], material: ["clay", "iterations", "trap"],
                       palette: Object.keys(palettes) };

export const usual = Object.fromEntries([
  ...Object.entries(ranges).map(([name, range]) => [name, range[0]]),
  ...Object.entries(words).map(([name, list]) => [name, list[0]]),
  ["look", null],  // the point in the middle, shape units
]);

/** The state now. Change it through `change`. */
export const state = { ...usual };
export const differs = (...names) => names.some((name) => state[name] !== usual[name]);

/** The knobs that the state stands for. */
export function knobsOf() {
  return {
    detail: state.detail, order: state.order, slice: state.slice, drift: state.drift, rotate: state.rotate,
    phase: differs("phase1", "phase2", "phase3") ? phaseOf([state.phase1, state.phase2, state.phase3]) : usualPhase,
    axis: axisOf(state.axis), scale: state.scale, tufts: state.tufts,
  };
}

const isIn = (name, value) => Number.isFinite(value) && value >= ranges[name][1] && value <= ranges[name][2] &&
                              (!whole.includes(name) || Number.isInteger(value));

/** The states that a text such as "detail=0.03&material=trap" names; what it makes no sense of stays usual. */
function read(text) {
  const result = { ...usual };
  for (const [name, value] of new URLSearchParams(text)) {
    if (Object.hasOwn(ranges, name) && value !== "" && isIn(name, Number(value))) result[name] = Number(value);
    if (Object.hasOwn(words, name) && words[name].includes(value)) result[name] = value;
    if (name === "look") {
      const point = value.split(",").map(Number);
      if (point.length === 3 && point.every(Number.isFinite)) result.look = point;
    }
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
