// The spline of a map's paint: host/map/map_parts.cpp.
import { bind, gl, texture } from "./gl.js";
import { inflated, map } from "./map.js";

/** Hands what shares lack of 1 to the programs, where the map has paint. */
export async function uploadPaint() {
  if (!map.paint) return;
  const shares = await inflated(map.paint.data), made = texture(gl.R32F, map.paint.cells);
  bind("paint", gl.TEXTURE_3D, made);
  gl.texSubImage3D(gl.TEXTURE_3D, 0, 0, 0, 0, ...map.paint.cells, gl.RED, gl.FLOAT,
                   Float32Array.from(shares, (share) => (255 - share) / 256));
}
