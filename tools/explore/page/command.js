// The command lines that make what the page shows.
import { root } from "./dom.js";
import { bears } from "./map.js";
import { differs, knobsOf, short, state } from "./state.js";

const quoted = (text) => /^[\w.\/+-]+$/.test(text) ? text : `'${text.replaceAll("'", "'\\''")}'`;

/** The map's name, which must not read as an option. */
const mapWord = () => quoted(root.dataset.map.replace(/^-/, "./-"));

/** [option, values] of rows [whether it is needed, option, ...values]. */
const needed = (rows) => rows.filter(([isNeeded]) => isNeeded).map(([, name, ...values]) => [name, values.map(short)]);

/** What differs from the map as it is. */
function mapOptions() {
  const knobs = knobsOf();
  return needed([
    [differs("iterations"), "iterations", state.iterations],
    [bears.detail && differs("detail"), "detail", state.detail],
    [bears.order && differs("order"), "order-seed", state.order],
    [differs("phase1", "phase2", "phase3"), "phase", ...knobs.phase],
    [differs("slice"), "slice", state.slice],
    [bears.rotate && differs("rotate"), "rotate", ...knobs.axis, state.rotate],
    [bears.drift && differs("drift"), "drift", state.drift],
    [differs("scale"), "scale", state.scale],
    [differs("tufts"), "tufts", state.tufts],
  ]);
}

const pictureOptions = () => needed([
  ...["azimuth", "elevation", "zoom"].map((name) => [differs(name), name, state[name]]),
  [state.look, "look-at", ...(state.look ?? [])],
  ...["up", "material", "palette"].map((name) => [differs(name), name, state[name]]),
  [differs("lightaz", "lightup", "light"), "lamp", state.lightaz, state.lightup, state.light],
]);

const cuts = () => ["x", "y", "z"].filter((axis) => state["cut" + axis] < 100).map((axis) => [axis, short(state["cut" + axis])]);

const commandOf = (name, output, options) =>
  ["qjulia", name, mapWord(), "-o", output, ...options.flatMap(([option, values]) => [`--${option}`, ...values])].join(" ");

export function renderCommand(width, height) {
  const cut = cuts().map(([axis, at]) => `${axis}=${at}%`).join(",");
  // A browser draws all of the set, loose pieces too.
  const drawsAll = root.dataset.renderer === "webgl";
  return commandOf("render", "picture.png", [["size", [`${width}x${height}`]], ...pictureOptions(), ...needed([[cut, "cut", cut]]),
                                             ...mapOptions(), ...needed([[drawsAll, "keep-loose"]])]);
}

export const surfaceCommand = () => commandOf("surface", "surface.ply", mapOptions());

/** The same as the query of a request to qjulia explore. */
export function queryOf() {
  const options = [...pictureOptions(), ...mapOptions(), ...cuts().map(([axis, at]) => [`cut-${axis}`, [at]])];
  return Object.fromEntries(options.map(([name, values]) => [name, values.join(",")]));
}
