// What the host has baked of this page's map (tools/explore/page_scene.hpp), looked up for where the knobs stand.
import { byId } from "./dom.js";
import { unpacked } from "./packed.js";

/** { files, portals, factors, groups, uniforms, phase, table, ranges }. */
export const scene = JSON.parse(byId("scene").textContent);
const { table } = scene;
const entries = await unpacked(table.entries), entryBytes = 5;

/** The cell of rising nodes that holds a value; beyond their range, the one at its end. */
const cellOf = (nodes, value) => nodes.slice(1, -1).filter((node) => node <= value).length;

/** The host's list over rising nodes, linear in between. */
function between(nodes, list, value) {
  const after = nodes.findIndex((node) => node >= value);
  if (after <= 0) return list.at(after);
  return list[after - 1] + (value - nodes[after - 1]) / (nodes[after] - nodes[after - 1]) * (list[after] - list[after - 1]);
}

/** { uniforms, grid }: what shaders take of a map with these knobs. @param knobs as `knobsOf` has them. */
export function look(knobs, iterations) {
  const cell = table.knobs.reduce((at, { knob, nodes }) => at * (nodes.length - 1) + cellOf(nodes, knobs[knob]), 0);
  const [inner, outer, band, slope, singleSlope] = entries.subarray(entryBytes * cell, entryBytes * (cell + 1));
  const slice = cellOf(table.slices, knobs.slice), [map_log_outer, map_log_escape] = table.outer[outer];
  return {
    grid: { ...table.grids[slice][band], slice: knobs.slice, band },
    uniforms: {
      ...scene.uniforms, groups: scene.groups, iterations, map_log_inner: table.inner[inner], map_log_outer, map_log_escape,
      map_surface_level: between(table.drifts, table.levels, knobs.drift), band_slope: table.slopes[slice][iterations === 1 ? singleSlope : slope],
      knob_detail: knobs.detail, knob_drift: knobs.drift, knob_scale: knobs.scale,
      map_slice: knobs.slice, map_phase: knobs.phase, map_steepness: knobs.steepness,
    },
  };
}
