// The page of `qjulia share`: the viewer's own graphics draw.
import { canvas, fail } from "./dom.js";
import { factorsAreIn, gl, uploadFactors } from "./gl.js";
import { uploadDistances, uploadPaint } from "./splines.js";
import { asked, evaluate, uniformsOf } from "./field.js";
import { map } from "./map.js";
import { start } from "./page.js";
import { depths, draw, figures } from "./picture.js";
import { isCoarse, mapFile } from "./scene.js";
import { usualEscape } from "./settings.js";

canvas.addEventListener("webglcontextlost", () => fail(new Error("the browser has taken its graphics away: load the page again")));
await uploadDistances();
await uploadPaint();
start({ draw, isCoarse, mapFile, most: gl.getParameter(gl.MAX_TEXTURE_SIZE) });

/** F_n of the map as it is in the file, or with 0 iterations its versor, at an array of points [X, Y, Z, W]. */
function at(points, iterations) {
  uploadFactors(map.factors);
  const wanted = iterations > 0 ? asked.field : asked.versor;
  const uniforms = uniformsOf(map, { inner: 0, outer: Infinity, escape: usualEscape });
  return [...evaluate(uniforms, new Float32Array(points.flat()), wanted, { iterations })];
}
Object.assign(globalThis.qjulia, { depths, figures, mapFile, at, factorsAreIn });
