// The splines of a distance modulus and of paint, as the map's file holds them: the GPU takes them out.
import { bind, drawAll, drawn, drawTo, gl, program, texture, use } from "./gl.js";
import { mapText } from "./map.js";
import { unpacked } from "./packed.js";

const held = JSON.parse(mapText()), listWidth = 4096;

/** A texture of the bytes of a file, or of whole numbers; it is bound to that name. */
function listTexture(name, format, count) {
  const size = [listWidth, Math.max(1, Math.ceil(count / listWidth))], handle = texture(format, size);
  bind(name, gl.TEXTURE_2D, handle);
  return { handle, size };
}

/** Sums over a list in the file's bytes, as unpack.glsl has them; bound to a name. */
function sums(unpack, name, values) {
  let [last, next] = [0, 1].map(() => listTexture(name, gl.R32I, values.count));
  const turn = (stride) => {
    bind("sums", gl.TEXTURE_2D, last.handle);
    drawTo(next.handle, ...next.size);
    use(unpack, { ...values, stride });
    drawAll();
    [last, next] = [next, last];
  };
  for (let stride = 0; stride < values.count; stride = 2 * stride || 1) turn(stride);
  gl.deleteTexture(next.handle);
  bind(name, gl.TEXTURE_2D, last.handle);
}

/** Hands the grid's coefficients to the programs, where the map has a grid. */
export async function uploadDistances() {
  if (!held.distance) return;
  const { cells, blocks, data } = held.distance, coarse_cells = cells.map((n) => n / 4), [x, y, z] = coarse_cells, count = x * y * z;
  if (Math.max(...cells) > gl.getParameter(gl.MAX_3D_TEXTURE_SIZE)) {
    throw new Error(`this browser's graphics cannot hold a grid of ${cells.join(" x ")} cells`);
  }
  const bytes = await unpacked(data), file = listTexture("file_bytes", gl.R8UI, bytes.length);
  const whole = new Uint8Array(file.size[0] * file.size[1]);
  whole.set(bytes);
  gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, ...file.size, gl.RED_INTEGER, gl.UNSIGNED_BYTE, whole);
  const unpack = program("unpack.glsl"), mask = 2 * count;
  sums(unpack, "coarse", { kind: 0, first: 0, count });
  sums(unpack, "ranks", { kind: 1, first: mask, count });
  sums(unpack, "corrections", { kind: 0, first: mask + Math.ceil(count / 8), count: 64 * blocks });
  const widened = await layered("widened.glsl", [cells[0], cells[1], z], { coarse_cells });
  bind("widened", gl.TEXTURE_3D, widened);
  bind("coefficients", gl.TEXTURE_3D, await layered("coefficients.glsl", cells, { coarse_cells }));
  gl.deleteTexture(widened);
}

/** A texture of three sides, drawn layer by layer. */
async function layered(file, size, values) {
  const handle = texture(gl.R32F, size), drawing = program(file);
  for (let layer = 0; layer < size[2]; ++layer) {
    drawTo(handle, size[0], size[1], layer);
    use(drawing, { ...values, layer });
    drawAll();
    if (layer % 8 === 7) await drawn();
  }
  await drawn();
  return handle;
}

/** Hands the paint's shares to the programs, where the map has paint. */
export async function uploadPaint() {
  if (!held.paint) return;
  const { cells, data } = held.paint, bytes = await unpacked(data);
  bind("paint", gl.TEXTURE_3D, texture(gl.R8, cells));
  gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
  gl.texSubImage3D(gl.TEXTURE_3D, 0, 0, 0, 0, ...cells, gl.RED, gl.UNSIGNED_BYTE, bytes);
}
