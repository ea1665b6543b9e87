// The command lines that make what the page shows.
import { viewOf } from "./camera.js";
import { canvas, root } from "./dom.js";
import { frame, toShape } from "./map.js";
import { backdropOptions, changed, short, state } from "./state.js";

const quoted = (text) => /^[\w.\/+-]+$/.test(text) ? text : `'${text.replaceAll("'", "'\\''")}'`;

/** The map's name, which must not read as an option. */
const mapWord = () => quoted(root.dataset.map.replace(/^-/, "./-"));

/** The option of the places where the set is cut open, if there are any. */
function cut(values) {
  const places = ["x", "y", "z"].filter((axis) => values["cut" + axis] < 100).map((axis) => `${axis}=${short(values["cut" + axis])}%`);
  return places.length > 0 ? [["cut", places]] : [];
}

const background = (values) => backdropOptions(values).map(([name, value]) => [name, [value]]);

const commandOf = (name, output, options) =>
  ["qjulia", name, mapWord(), "-o", output, ...options.flatMap(([option, values]) => [`--${option}`, ...values])].join(" ");

/** The options of the picture, with where the camera stands, which the program would choose otherwise. */
function pictureOptions(values, width, height) {
  const view = viewOf(values, width, height, 1);
  const rest = changed("picture", values).filter(([option]) => option !== "look-at" && option !== "distance");
  return [...rest, ["look-at", toShape(view.middle).map(short)], ["distance", [short(view.distance / frame.scale)]]];
}

/** @param range of the material, where it is not spread over what the picture shows. */
export function renderCommand(width, height, range = null) {
  // A browser draws all of the set, loose pieces too.
  const drawsAll = root.dataset.renderer === "webgl";
  return commandOf("render", "picture.png", [
    ["size", [`${width}x${height}`]], ...pictureOptions(state, width, height), ...background(state), ...cut(state).map(([option, places]) => [option, [places.join(",")]]), ...changed("map"),
    ...(drawsAll ? [["keep-loose", []]] : []), ...(range ? [["range", [range.map(short).join(",")]]] : []),
  ]);
}

/** Makes the map with its knobs turned of the map that the page holds, saved under its own name. */
export const convertCommand = (saved) => ["qjulia", "convert", quoted(`./${saved}`), quoted(`./${saved.replace(/(\.qjulia)?\.json$/, "_turned$&")}`),
  ...changed("map").filter(([option]) => option !== "iterations").flatMap(([option, values]) => [`--${option}`, ...values])].join(" ");

/** Serves the page on which everything can be set. */
export const exploreCommand = () => `qjulia explore ${mapWord()} --open`;

export const surfaceCommand = () => commandOf("surface", "surface.ply", changed("map"));

/** A state's picture of this size as the query of a request to qjulia explore. */
export function queryOf(values = state, width = canvas.width, height = canvas.height) {
  const options = [...pictureOptions(values, width, height), ...background(values), ...changed("map", values), ...cut(values)];
  return Object.fromEntries(options.map(([name, values]) => [name, values.join(",")]));
}
