// What does not change while a slice stays: the file's F_1 - L on a grid about the set, drawn by the GPU.
import { bind, drawAll, drawn, drawTo, gl, program, texture, use } from "./gl.js";

const layers = program("grid.glsl");
let grid = null;

/** Whether the grid was made in haste. */
export const isCoarse = () => grid !== null && !grid.isFine;

/** The uniforms of the grid that a scene needs; it is drawn where none is there that reaches as far.
 * @param isMoving a coarse one will do. */
export async function gridOf({ grid: wanted, uniforms }, isMoving) {
  const isEnough = grid && grid.slice === wanted.slice && grid.band >= wanted.band && (grid.isFine || isMoving);
  if (!isEnough) {
    const cells = isMoving ? wanted.coarse : wanted.fine, points = cells.map((n) => n + 1);
    const handle = texture(gl.RG16F, points, gl.LINEAR);
    for (let layer = 0; layer < points[2]; ++layer) {
      drawTo(handle, points[0], points[1], layer);
      use(layers, { ...uniforms, low: wanted.grid_low, high: wanted.grid_high, cells, layer });
      drawAll();
      if (layer % 4 === 3) await drawn();
    }
    await drawn();
    if (grid) gl.deleteTexture(grid.handle);
    grid = { ...wanted, isFine: !isMoving, cells, handle };
  }
  return { grid_low: grid.grid_low, grid_high: grid.grid_high, grid_cells: grid.cells };
}

export const bindGrid = () => bind("grid", gl.TEXTURE_3D, grid.handle);
