// The map at points, computed by the GPU, and what follows from it: calibration, radii at which orbits
// are decided, slopes. host/map/calibration.cpp and stop_radii.cpp.
import { degree, rotationOf } from "./map.js";
import { bind, drawAll, drawTo, gl, groups, program, texture, use } from "./gl.js";
import { usualEscape } from "./settings.js";
import { length, plus, times, transpose } from "./vectors.js";

const points = program("points.glsl");
const wide = 256, most = 64;  // points of a draw: rows of a texture
const [pointTexture, resultTexture] = [0, 1].map(() => texture(gl.RGBA32F, [wide, most]));
export const asked = { field: 0, versor: 1, gradient: 2, crossing: 3 };

/** The uniforms of map.glsl and the kinds' files. */
export function uniformsOf(m, radii = { inner: 0, outer: Infinity, escape: Infinity }) {
  const ln = (x) => x === Infinity ? 1e30 : x > 0 ? Math.log(x) : -1e30;
  const values = {
    groups, map_log_scale: m.log_scale, map_slice: m.slice, map_phase: m.phase ?? [1, 0, 0, 0],
    map_surface_level: m.surface_level ?? 0, map_steeper: (m.steepness ?? 1) - 1,
    map_log_inner: ln(radii.inner), map_log_outer: ln(radii.outer), map_log_escape: ln(radii.escape),
    modulus_c: m.c ?? [0, 0, 0, 0], versor_c: m.c ?? [0, 0, 0, 0],
  };
  if (m.noise) {
    Object.assign(values, { noise_octaves: m.noise.octaves, noise_scale: m.noise.scale, noise_seed: m.noise.seed,
                            noise_components: m.noise.values === "quaternions" ? 4 : 3, noise_origin: m.noise.origin });
  }
  if (m.distance) {
    Object.assign(values, { distance_per_shell: 1 / m.distance.shell, distance_inradius: m.distance.inradius,
                            distance_fourth: Number(m.distance.fourth === "round"), distance_step: m.distance.step,
                            distance_origin: m.distance.origin, distance_cells: m.distance.cells });
  }
  if (m.paint) {
    Object.assign(values, { paint_origin: m.paint.origin, paint_step: m.paint.step, paint_cells: m.paint.cells, paint_strength: 1 });
  }
  if (m.portals?.length) {
    const masks = { none: 0, outside: 1, inside: -1 };
    values.portal_count = m.portals.length;
    values.portal_balls = m.portals.map((p) => [...p.center, p.radius]);
    values.portal_destinations = m.portals.map((p) => [...(p.destination ?? [0, 0, 0]), masks[p.mask ?? "none"]]);
    values.portal_matrices = m.portals.map((p) => transpose(rotationOf(p)).map((c) => times(p.scale, c)));
    values.portal_scales = m.portals.map((p) => p.scale);
  }
  return values;
}

/** Four numbers for each point (X, Y, Z, W; map coordinates) of a Float32Array. Factors must be uploaded. */
export function evaluate(uniforms, xyzw, wanted, options = {}) {
  const result = new Float32Array(xyzw.length), count = xyzw.length / 4;
  const settings = { iterations: 1, limit: 1, wanted, ...options, ...uniforms };
  for (let first = 0; first < count; first += wide * most) {
    const rows = Math.min(most, Math.ceil((count - first) / wide));
    const part = new Float32Array(4 * wide * rows);
    part.set(xyzw.subarray(4 * first, 4 * (first + wide * rows)));
    bind("points", gl.TEXTURE_2D, pointTexture);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, wide, rows, gl.RGBA, gl.FLOAT, part);
    drawTo(resultTexture, wide, rows);
    use(points, settings);
    drawAll();
    gl.readPixels(0, 0, wide, rows, gl.RGBA, gl.FLOAT, part);
    result.set(part.subarray(0, Math.min(part.length, result.length - 4 * first)), 4 * first);
  }
  return result;
}

/** Even directions over the sphere of four dimensions: host/map/sphere_directions.hpp. */
function sphereDirections(count) {
  const root = 1.2207440846057596, directions = new Float32Array(4 * count);
  for (let i = 0; i < count; ++i) {
    const u = (0.5 + (i + 1) / root) % 1, a = 2 * Math.PI * ((0.5 + (i + 1) / root ** 2) % 1);
    const b = 2 * Math.PI * ((0.5 + (i + 1) / root ** 3) % 1), s = Math.sqrt(1 - u), c = Math.sqrt(u);
    directions.set([s * Math.sin(a), s * Math.cos(a), c * Math.sin(b), c * Math.cos(b)], 4 * i);
  }
  return directions;
}

/** The radius to which the set reaches in most directions; 0 where the origin is outside. */
export function effectiveRadius(m) {
  const limit = 3 * Math.sqrt(3), directions = sphereDirections(4096);
  const found = evaluate(uniformsOf(m), directions, asked.crossing, { limit });
  const radii = Array.from({ length: 4096 }, (_, i) => found[4 * i]).sort((a, b) => a - b);
  const radius = 0.5 * (radii[2047] + radii[2048]);
  return radius > 1e-6 * limit ? radius : 0;
}

const firstRadius = 0.05, rows = 66, ratio = 1.09;

/** Rows { radius, highest, lowest }: the highest of F_1 - L in the ball, the lowest on the sphere. F of
 * other details is so many times as high. */
export function extremes(m) {
  const directions = [...sphereDirections(512)];
  for (let i = 0; i < 128; ++i) {  // those of the slice W = 0
    const d = directions.slice(4 * i, 4 * i + 3), size = length(d);
    directions.push(...times(1 / size, d), 0);
  }
  for (const { center } of m.factors ?? []) {
    const size = length(center);
    if (size > 0) directions.push(...times(1 / size, center));
  }
  const count = directions.length / 4, all = new Float32Array(4 * count * rows);
  for (let row = 0; row < rows; ++row) {
    const radius = firstRadius * ratio ** row;
    for (let i = 0; i < 4 * count; ++i) all[4 * count * row + i] = radius * directions[i];
  }
  // Paint makes F farther from L: what holds without it holds.
  const uniforms = { ...uniformsOf(m), map_steeper: 0, paint_strength: 0 }, level = uniforms.map_surface_level;
  const found = evaluate(uniforms, all, asked.field, { iterations: 0 });
  // Close to a pole F_1 is high in a neighbourhood that no direction need meet.
  const poles = (m.factors ?? []).filter((f) => f.exponent < 0).map((f) => plus(f.center, [1e-3, 0, 0, 0]));
  const byPoles = evaluate(uniforms, new Float32Array(poles.flat()), asked.field, { iterations: 0 });
  let highest = -Infinity;
  return Array.from({ length: rows }, (_, row) => {
    const radius = firstRadius * ratio ** row;
    let lowest = Infinity;
    for (let i = 0; i < count; ++i) {
      const f = found[4 * (count * row + i) + 1] - level;
      lowest = Math.min(lowest, f), highest = Math.max(highest, f);
    }
    poles.forEach((p, k) => { if (length(p) <= radius) highest = Math.max(highest, byPoles[4 * k + 1] - level); });
    return { radius, highest, lowest };
  });
}

/** Where orbits are decided, for F = rise(F_1 - L of the table); r_in < e^L < r_out. */
export function stopRadii(table, rise, m) {
  const level = m.surface_level ?? 0;
  let inner = 0, outer = Infinity;
  for (const { radius, highest } of table) {
    if (radius < Math.exp(level - levelMargin) && rise(highest) <= Math.log(0.97 * radius)) inner = radius;
  }
  if (degree > 1) {
    let last = table.length - 1;
    while (last >= 0 && rise(table[last].lowest) > Math.log(radiusAbove(table[last].radius)) + 0.03) --last;
    outer = last === table.length - 1 ? Infinity : 1.02 * radiusAbove(table[Math.max(last, 0)].radius);
  }
  const bounded = outer < Infinity;
  outer = Math.max(outer, Math.exp(level + levelMargin));
  for (const portal of m.portals ?? []) {
    const away = length(portal.center);
    inner = Math.min(inner, away - portal.radius), outer = Math.max(outer, away + portal.radius);
  }
  return { inner, outer, escape: bounded ? 1.25 * outer : Math.max(usualEscape, 1.25 * Math.exp(level)) };
}
const levelMargin = 1e-5;
const radiusAbove = (radius) => radius * ratio;
