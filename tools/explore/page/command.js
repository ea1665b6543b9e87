// The command lines that make what the page shows.
import { bears } from "./map.js";
import { knobsOf, state, usual } from "./state.js";

const short = (v) => String(Number(v.toPrecision(7)));
const quoted = (text) => /^[\w.\/+-]+$/.test(text) ? text : `'${text.replaceAll("'", "'\\''")}'`;
const file = document.documentElement.dataset.map;  // the name of the map's file

/** What differs from the map as it is: [option, values]. */
function mapOptions() {
  const knobs = knobsOf(), options = [];
  const add = (name, ...values) => options.push([name, values.map((v) => typeof v === "number" ? short(v) : v)]);
  if (state.iterations !== usual.iterations) add("iterations", state.iterations);
  if (bears.detail && state.detail !== usual.detail) add("detail", state.detail);
  if (bears.order && state.order > 0) add("order-seed", state.order);
  if (["phase1", "phase2", "phase3"].some((name) => state[name] !== usual[name])) add("phase", ...knobs.phase);
  if (state.slice !== usual.slice) add("slice", state.slice);
  if (bears.rotate && state.rotate !== 0) add("rotate", ...knobs.axis, state.rotate);
  if (bears.drift && state.drift !== 0) add("drift", state.drift);
  if (state.scale !== 1) add("scale", state.scale);
  if (state.tufts !== usual.tufts) add("tufts", state.tufts);
  return options;
}

function pictureOptions() {
  const options = ["azimuth", "elevation", "zoom"].filter((name) => state[name] !== usual[name])
    .map((name) => [name, [short(state[name])]]);
  if (state.look) options.push(["look-at", state.look.map(short)]);
  if (state.up !== usual.up) options.push(["up", [state.up]]);
  if (state.material !== "clay") options.push(["material", [state.material]]);
  if (state.palette !== usual.palette) options.push(["palette", [state.palette]]);
  const lamp = ["lightaz", "lightup", "light"];
  if (lamp.some((name) => state[name] !== usual[name])) options.push(["lamp", lamp.map((name) => short(state[name]))]);
  return options;
}

const cuts = () => ["x", "y", "z"].filter((axis) => state["cut" + axis] < 100).map((axis) => [axis, short(state["cut" + axis])]);
const spelt = (options) => options.map(([name, values]) => [`--${name}`, ...values].join(" "));
const drawsAll = document.documentElement.dataset.renderer === "webgl";  // of the set, loose pieces too

export function renderCommand(width, height) {
  const cut = cuts().length > 0 ? [["cut", [cuts().map(([axis, at]) => `${axis}=${at}%`).join(",")]]] : [];
  const options = [["size", [`${width}x${height}`]], ...pictureOptions(), ...cut, ...mapOptions(), ...(drawsAll ? [["keep-loose", []]] : [])];
  return ["qjulia render", quoted(file), "-o picture.png", ...spelt(options)].join(" ");
}

export function surfaceCommand() {
  return ["qjulia surface", quoted(file), "-o surface.ply", ...spelt(mapOptions())].join(" ");
}

/** The same as the query of a request to qjulia explore. */
export function queryOf() {
  const options = [...pictureOptions(), ...mapOptions(), ...cuts().map(([axis, at]) => [`cut-${axis}`, [at]])];
  return Object.fromEntries(options.map(([name, values]) => [name, values.join(",")]));
}
