// The map of the page, and its knobs: host/map/knobs.cpp and detail.cpp. A map file's own names.
import { apply, boxAround, identity, imageOfBox, inner, length, multiply, plus, times, transpose, turnAbout } from "./vectors.js";
import { byId } from "./dom.js";
import { shuffled } from "./random.js";
import { bears } from "./settings.js";

export const map = JSON.parse(byId("qjulia-map").textContent);

const kinds = { rational: ["factors", "factors"], quadratic: ["quadratic", "quadratic"] }[map.kind] ?? map.kind.split("/");
export const [modulusKind, versorKind] = kinds;
const hasFactorsModulus = modulusKind === "factors", hasGrid = modulusKind === "distance";

/** The bytes of a zlib stream that stands in a map file. */
export async function inflated(text) {
  const packed = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

export const degree = hasFactorsModulus ? map.factors.reduce((sum, f) => sum + f.exponent, 0)
                                        : hasGrid ? Infinity : 2;
export const toMap = (p, m = map) => plus(times(m.shape_to_map.scale, p), m.shape_to_map.translation);
export const toShape = (p, m = map) =>
  times(1 / m.shape_to_map.scale, plus(p, m.shape_to_map.translation, -1));

/** A unit quaternion by three angles, degrees. */
export function phaseOf([a, b, c]) {
  const [r, s, t] = [a, b, c].map((degrees) => degrees * Math.PI / 180);
  return [Math.cos(r), Math.sin(r) * Math.cos(s), Math.sin(r) * Math.sin(s) * Math.cos(t),
          Math.sin(r) * Math.sin(s) * Math.sin(t)];
}

/** The map with these knobs turned, as with_knobs has it but for the calibration and what comes after.
 * `turn` and `offset` lead from the file's coordinates to its own: x = turn · x + offset. `steep`: how
 * many times as steep F is. */
export function turned(knobs) {
  const result = structuredClone({ ...map, distance: undefined });
  if (map.distance) result.distance = { ...map.distance };  // whose data is long, and stays
  result.steep = bears("detail") ? map.detail / knobs.detail : 1;
  if (bears("detail") && knobs.detail !== map.detail) {
    if (hasGrid) result.distance.shell /= result.steep;
    else for (const factor of result.factors) factor.exponent *= result.steep;
    const level = map.surface_level ?? 0;
    result.log_scale = result.steep * (map.log_scale - level) + level;
    result.detail = knobs.detail;
  }
  if (bears("order-seed") && knobs.order > 0) result.factors = shuffled(result.factors, knobs.order);
  result.phase = knobs.phase;
  result.slice = knobs.slice;
  result.turn = bears("rotate") ? turnAbout(knobs.axis, knobs.rotate) : identity;
  result.offset = [0, 0, 0];
  if (bears("rotate") && knobs.rotate !== 0) rotate(result);
  if (bears("drift") && knobs.drift !== 0) move(result, [0, 0, knobs.drift * map.inradius * map.shape_to_map.scale]);
  result.steepness = knobs.steepness;
  return result;
}

function rotate(result) {
  const { turn } = result;
  for (const factor of result.factors) {
    factor.center = [...apply(turn, factor.center.slice(0, 3)), factor.center[3]];
  }
  for (const portal of result.portals ?? []) {
    portal.center = apply(turn, portal.center);
    portal.destination = apply(turn, portal.destination ?? [0, 0, 0]);
    portal.matrix = multiply(multiply(turn, rotationOf(portal)), transpose(turn));
    if (portal.rotation) portal.rotation = axisAndAngle(portal.matrix);
  }
  const origin = toShape([0, 0, 0]);
  if (!result.box) return;
  result.diagonal ??= length(plus(result.box[1], result.box[0], -1));  // the turned box has a longer one
  result.box = imageOfBox(result.box, turn, origin, origin);
}

function move(result, offset) {
  for (const factor of result.factors ?? []) factor.center = plus(factor.center, [...offset, 0]);
  for (const part of [result.distance, result.noise, result.paint]) {
    if (part) part.origin = plus(part.origin, offset);
  }
  for (const portal of result.portals ?? []) {
    portal.center = plus(portal.center, offset);
    portal.destination = plus(portal.destination ?? [0, 0, 0], offset);
  }
  result.shape_to_map.translation = plus(result.shape_to_map.translation, offset);
  result.offset = offset;
}

/** A portal's rotation as a matrix. */
export function rotationOf(portal) {
  if (portal.matrix) return portal.matrix;
  const [x, y, z, degrees] = portal.rotation ?? [1, 0, 0, 0];
  return turnAbout([x, y, z], degrees);
}

function axisAndAngle(m) {
  const axis = [m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]];
  const angle = Math.atan2(length(axis), m[0][0] + m[1][1] + m[2][2] - 1) * 180 / Math.PI;
  if (length(axis) > 1e-9) return [...axis, angle];
  // By half a turn, or none: the axis is a column of m + 1.
  const column = m.map((row, i) => row.map((v, j) => v + (i === j ? 1 : 0)));
  const longest = transpose(column).sort((a, b) => length(b) - length(a))[0];
  return [...longest, angle];
}

/** The box of the shape and its copies in portals, shape units: box_with_copies. */
function boxWithCopies(m) {
  if (!m.box || !m.portals?.length) return m.box;
  let all = m.box.map((p) => toMap(p, m));
  for (let depth = 0; depth < 4; ++depth) {
    const before = all;
    for (const portal of m.portals) {
      const copy = preimage(portal, before);
      if (copy[0].every((low, i) => low <= copy[1][i])) all = boxAround(all, copy);
    }
  }
  return all.map((p) => toShape(p, m));
}

/** Where a box of the set is seen in a portal, as far as its ball reaches. */
function preimage(portal, box) {
  const back = transpose(rotationOf(portal)).map((row) => times(1 / portal.scale, row));
  const [low, high] = imageOfBox(box, back, portal.destination ?? [0, 0, 0], portal.center);
  return [portal.center.map((c, i) => Math.max(low[i], c - portal.radius)), portal.center.map((c, i) => Math.min(high[i], c + portal.radius))];
}

const outline = JSON.parse(byId("outline").textContent);

/** Points that reach as far in every direction as the set as the file has it, moved as the map's knobs move it, map
 * coordinates. Where the host had no device to find them, the middles of the sides of the box's top and bottom. */
export function outlineOf(m, { front, side, upright }) {
  if (outline.length > 0) return outline.map((p) => plus(apply(m.turn, toMap(p)), m.offset));
  const [low, high] = shapeBox(m), middle = times(0.5, plus(low, high)), half = times(0.5, plus(high, low, -1));
  const reach = (n) => times(inner(half, n), n);
  return [front, side].flatMap((n) => [-1, 1].flatMap((a) => [-1, 1].map((b) => plus(plus(middle, reach(n), a), reach(upright), b))));
}

/** The box of the shape and its copies, map coordinates; where the map knows none, what holds most maps. */
export function shapeBox(m = map) {
  return boxWithCopies(m)?.map((p) => toMap(p, m)) ?? [[-2, -2, -2], [2, 2, 2]];
}
