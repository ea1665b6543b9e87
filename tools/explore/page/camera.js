// The view of host/picture/view.cpp, in map coordinates; rows count upwards here. Where the camera
// has no place of its own, it stands so that the set fits from every azimuth, and a set that turns
// neither grows nor moves.
import { frame, toMap } from "./map.js";
import { outline } from "./outline.js";
import { across, axisOf, inner, plus, times } from "./vectors.js";

const fieldOfView = 30;
const filled = 0.9;   // share of the tighter side that the set fills at the azimuth where it is widest
const clear = 0.05;   // the eye keeps at least this distance from the set, as a share of its size
const radians = Math.PI / 180;

/** @param camera its `up` is a direction such as "-z". */
export function cameraAxes({ azimuth, elevation, up: name }) {
  const axis = name.at(-1), upright = times(name.length > 1 ? -1 : 1, axisOf(axis));
  const front = axisOf("xyz"[("xyz".indexOf(axis) + 1) % 3]), side = across(upright, front);
  const a = azimuth * radians, e = elevation * radians;
  const level = plus(times(Math.cos(a), front), side, Math.sin(a));
  const back = plus(times(Math.cos(e), level), upright, Math.sin(e));
  const right = plus(times(-Math.sin(a), front), side, Math.cos(a));
  return { right, up: across(back, right), back, upright, level, front, side };
}

/** The middle of the smallest circle around points of a plane, within about 1 % of its radius (Badoiu and Clarkson). */
function middleOf(points) {
  let [x, y] = points[0];
  for (let step = 2; step < 200; ++step) {
    let most = -1, farthest = null;
    for (const point of points) {
      const away = (point[0] - x) ** 2 + (point[1] - y) ** 2;
      if (away > most) [most, farthest] = [away, point];
    }
    x += (farthest[0] - x) / step;
    y += (farthest[1] - y) / step;
  }
  return [x, y];
}

/** The circles that the outline's points run through as the set turns about an upright axis: their radii, and heights above
 * the axis' middle. */
function ringsOf({ front, side, upright }) {
  const points = outline().map((p) => [front, side, upright].map((n) => inner(toMap(p), n)));
  const [x, y] = middleOf(points), heights = points.map((p) => p[2]), z = (Math.min(...heights) + Math.max(...heights)) / 2;
  return { middle: plus(plus(times(x, front), side, y), upright, z),
           rings: points.map((p) => [Math.hypot(p[0] - x, p[1] - y), p[2] - z]) };
}

let rings = {};
function knownRings(axes) {
  if (rings.of !== outline() || rings.upright !== axes.upright.join()) {
    rings = { of: outline(), upright: axes.upright.join(), found: ringsOf(axes) };
  }
  return rings.found;
}

/** How far the eye stands back, and how far the middle of the picture lies above that of the rings, along the picture's
 * columns, so that all rings are seen within these tangents from the middle. */
function placeFor(all, elevation, tanX, tanY) {
  const c = Math.cos(elevation * radians), s = Math.sin(elevation * radians);
  const most = (reach) => all.reduce((found, [r, z]) => Math.max(found, reach(r, z)), -Infinity);
  // A point of a ring, at the angle w from the camera, lies r sin w to the right, z c - r s cos w above, and z s + r c cos w
  // nearer than the middle: the largest of each side's reach is known for all w.
  const upright = (tan) => {
    const above = most((r, z) => z * (c + tan * s) + r * Math.abs(tan * c - s));
    const below = most((r, z) => z * (tan * s - c) + r * Math.abs(tan * c + s));
    return { back: (above + below) / (2 * tan), rise: (above - below) / 2 };
  };
  const size = 2 * most((r, z) => Math.hypot(r, z));
  const back = Math.max(upright(tanY).back, most((r, z) => z * s + r * Math.hypot(1 / tanX, c)),
                        most((r, z) => z * s + r * c) + clear * size);
  // Equal room above and below: the narrower the view, the farther back is its place.
  let low = 0, high = tanY;
  for (let halving = 0; halving < 50; ++halving) {
    const tan = (low + high) / 2;
    if (upright(tan).back > back) low = tan;
    else high = tan;
  }
  return { back, rise: upright(high).rise };
}

/** The view of a picture of width x height pixels that is drawn with 1 / divisor of them a side. */
export function viewOf(camera, width, height, divisor) {
  const axes = cameraAxes(camera), tanY = Math.tan(0.5 * fieldOfView * radians);
  const around = knownRings(axes), place = placeFor(around.rings, camera.elevation, filled * tanY * width / height, filled * tanY);
  const distance = camera.distance === null ? place.back : camera.distance * frame.scale;
  const pixel = 2 * tanY / (height / divisor) / camera.zoom;
  const middle = camera.look ? toMap(camera.look) : plus(around.middle, axes.up, place.rise);
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
