// The splines of a distance modulus and of paint: host/map/map_parts.cpp and distance_grid.cpp.
import { bind, gl, texture } from "./gl.js";
import { inflated, map } from "./map.js";

/** Hands coefficients to the programs. */
function upload(name, cells, coefficients) {
  bind(name, gl.TEXTURE_3D, texture(gl.R32F, cells));
  gl.texSubImage3D(gl.TEXTURE_3D, 0, 0, 0, 0, ...cells, gl.RED, gl.FLOAT, coefficients);
}

/** Whole numbers from their differences: all low bytes, then all high ones. */
function numbersIn(bytes) {
  const count = bytes.length / 2, numbers = new Int16Array(count);
  for (let i = 0, before = 0; i < count; ++i) {
    before += bytes[i] | bytes[count + i] << 8;
    numbers[i] = before;
  }
  return numbers;
}

/** The coefficients of the same spline on cells half as long along one axis (Chaikin 1974). */
function halved(from, cells, axis) {
  const along = cells[axis], stride = cells.slice(0, axis).reduce((product, n) => product * n, 1);
  const to = new Float32Array(2 * from.length);
  for (let o = 0; o < from.length / along / stride; ++o) {
    for (let i = 0; i < along; ++i) {
      const here = (o * along + i) * stride, first = 2 * here;
      const before = i > 0 ? here - stride : here, after = i + 1 < along ? here + stride : here;
      for (let k = 0; k < stride; ++k) {
        to[first + k] = 0.25 * from[before + k] + 0.75 * from[here + k];
        to[first + stride + k] = 0.75 * from[here + k] + 0.25 * from[after + k];
      }
    }
  }
  cells[axis] *= 2;
  return to;
}

/** Hands the grid's coefficients to the programs, where the map has a grid. */
export async function uploadDistances() {
  if (!map.distance) return;
  const bytes = await inflated(map.distance.data), cells = map.distance.cells.map((n) => n / 4);
  const coarse = cells[0] * cells[1] * cells[2], mask = 2 * coarse, begin = mask + Math.ceil(coarse / 8);
  let all = Float32Array.from(numbersIn(bytes.subarray(0, mask)), (n) => n / 64);
  const corrections = numbersIn(bytes.subarray(begin)), size = [...cells];
  for (const axis of [0, 1, 2, 0, 1, 2]) all = halved(all, size, axis);
  for (let block = 0, next = 0; block < coarse; ++block) {
    if (!(bytes[mask + (block >> 3)] >> (block & 7) & 1)) continue;
    const at = [block % cells[0], Math.floor(block / cells[0]) % cells[1], Math.floor(block / cells[0] / cells[1])];
    for (let i = 0; i < 64; ++i) {
      const [x, y, z] = [4 * at[0] + (i & 3), 4 * at[1] + (i >> 2 & 3), 4 * at[2] + (i >> 4)];
      all[(z * size[1] + y) * size[0] + x] += corrections[next++] / 256;
    }
  }
  if (Math.max(...size) > gl.getParameter(gl.MAX_3D_TEXTURE_SIZE)) {
    throw new Error(`this browser's graphics cannot hold a grid of ${size.join(" x ")} cells`);
  }
  upload("coefficients", size, all);
}

/** Hands what shares lack of 1 to the programs, where the map has paint. */
export async function uploadPaint() {
  if (map.paint) upload("paint", map.paint.cells, Float32Array.from(await inflated(map.paint.data), (share) => (255 - share) / 256));
}
