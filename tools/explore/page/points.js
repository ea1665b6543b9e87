// The map at points, computed by the GPU: for measurements and tests.
import { bind, drawAll, drawTo, gl, program, texture, use } from "./gl.js";

const points = program("points.glsl");
const wide = 256, most = 64;  // points of a draw: rows of a texture
const [pointTexture, resultTexture] = [0, 1].map(() => texture(gl.RGBA32F, [wide, most]));

/** Four numbers for each point (X, Y, Z, W; map coordinates) of a Float32Array, as points.glsl has them. */
export function evaluate(uniforms, xyzw, iterations) {
  const result = new Float32Array(xyzw.length), count = xyzw.length / 4;
  for (let first = 0; first < count; first += wide * most) {
    const rows = Math.min(most, Math.ceil((count - first) / wide));
    const part = new Float32Array(4 * wide * rows);
    part.set(xyzw.subarray(4 * first, 4 * (first + wide * rows)));
    bind("points", gl.TEXTURE_2D, pointTexture);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, wide, rows, gl.RGBA, gl.FLOAT, part);
    drawTo(resultTexture, wide, rows);
    use(points, { ...uniforms, iterations });
    drawAll();
    gl.readPixels(0, 0, wide, rows, gl.RGBA, gl.FLOAT, part);
    result.set(part.subarray(0, Math.min(part.length, result.length - 4 * first)), 4 * first);
  }
  return result;
}
