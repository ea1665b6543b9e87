// The page of `qjulia share`: the viewer's own graphics draw.
import { canvas, fail } from "./dom.js";
import { convertCommand } from "./command.js";
import { factorsAreIn, gl } from "./gl.js";
import { isCoarse } from "./grid.js";
import { mapText } from "./map.js";
import { start } from "./page.js";
import { depths, draw, drawSmall, figures, pointAt, rangeNow } from "./picture.js";
import { evaluate } from "./points.js";
import { mapFileName } from "./save.js";
import { look, scene } from "./scene.js";
import { settings } from "./settings.js";
import { uploadDistances, uploadPaint } from "./splines.js";
import { differs, knobsOf, namesOf, state } from "./state.js";

canvas.addEventListener("webglcontextlost", () => fail(new Error("the browser has taken its graphics away: load the page again")));
await uploadDistances();
await uploadPaint();
const knobs = settings.map.filter((setting) => setting.option !== "iterations").flatMap(namesOf);
const mapFile = () => {
  const name = mapFileName();
  return { text: mapText(), name, command: differs(...knobs) ? convertCommand(name) : null };
};
start({ draw, drawSmall, pointAt, isCoarse, mapFile, rangeNow, most: gl.getParameter(gl.MAX_TEXTURE_SIZE) });

const looked = () => look(knobsOf(scene.phase), state.iterations);

/** F_n of the map with its knobs and an escape radius of 20, or with 0 iterations its versor, at an array of points [X, Y, Z, W]. */
function at(points, iterations) {
  const { uniforms } = looked();
  return [...evaluate({ ...uniforms, map_log_escape: Math.log(20) }, new Float32Array(points.flat()), iterations)];
}
Object.assign(globalThis.qjulia, { depths, figures, mapFile, at, factorsAreIn, looked });
