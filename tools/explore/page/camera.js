// The view of host/picture/view.cpp, in map coordinates; rows count upwards here. Where the camera
// has no distance of its own, it stands so far away that a box fits from every azimuth, so that a
// set that turns neither grows nor moves.
import { toMap } from "./map.js";
import { across, axisOf, inner, plus, times, unit } from "./vectors.js";

const shell = 1.06, fill = 0.96, fieldOfView = 30;
const radians = Math.PI / 180;

/** @param camera its `up` is a direction such as "-z". */
export function cameraAxes({ azimuth, elevation, up: name }) {
  const axis = name.at(-1), upright = times(name.length > 1 ? -1 : 1, axisOf(axis));
  const front = axisOf("xyz"[("xyz".indexOf(axis) + 1) % 3]), side = across(upright, front);
  const a = azimuth * radians, e = elevation * radians;
  const level = plus(times(Math.cos(a), front), side, Math.sin(a));
  const back = plus(times(Math.cos(e), level), upright, Math.sin(e));
  const right = plus(times(-Math.sin(a), front), side, Math.cos(a));
  return { right, up: across(back, right), back, upright, level };
}

/** Half of the extent along n of the upright elliptic cylinder in a box. */
function extent([low, high], upright, n) {
  const reach = n.map((v, i) => 0.5 * shell * (high[i] - low[i]) * Math.abs(v));
  const along = Math.abs(inner(reach, upright));
  return along + Math.sqrt(Math.max(inner(reach, reach) - along * along, 0));
}

function framingDistance(camera, box, tanX, tanY) {
  let distance = 0;
  for (let azimuth = 0; azimuth < 360; azimuth += 5) {
    const { right, up, back, upright } = cameraAxes({ ...camera, azimuth });
    const from = (n, tangent) => extent(box, upright, unit(plus(n, back, tangent))) * Math.hypot(1, tangent) / tangent;
    for (const sign of [-1, 1]) {
      distance = Math.max(distance, from(times(sign, right), tanX), from(times(sign, up), tanY));
    }
  }
  return distance;
}

/** The view of a picture of width x height pixels that is drawn with 1 / divisor of them a side.
 * @param box what is framed, map coordinates. */
export function viewOf(camera, m, box, width, height, divisor) {
  const axes = cameraAxes(camera), tanY = Math.tan(0.5 * fieldOfView * radians);
  const distance = camera.distance === null ? framingDistance(camera, box, fill * tanY * width / height, fill * tanY)
                                            : camera.distance * m.shape_to_map.scale;
  const pixel = 2 * tanY / (height / divisor) / camera.zoom;
  const middle = camera.look ? toMap(camera.look, m) : times(0.5, plus(box[0], box[1]));
  const dir_dx = times(pixel, axes.right), dir_dy = times(pixel, axes.up);
  const dir = plus(plus(times(-1, axes.back), dir_dx, -width / divisor / 2), dir_dy, -height / divisor / 2);
  // Lamps turn with the camera, and stay level.
  const lamp = (azimuth, elevation) => {
    const a = azimuth * radians, e = elevation * radians;
    return plus(times(Math.cos(e), plus(times(Math.sin(a), axes.right), axes.level, Math.cos(a))), axes.upright, Math.sin(e));
  };
  return {
    ...axes, eye: plus(middle, axes.back, distance), middle, distance, dir, dir_dx, dir_dy, divisor, footprint: distance * pixel,
    columns: Math.ceil(width / divisor), rows: Math.ceil(height / divisor), canvas: [width, height],
    key_direction: lamp(camera.lightaz, camera.lightup), rim_direction: lamp(128.7, 22.6), key_strength: camera.light,
  };
}
